// SPDX-License-Identifier: GPL-3.0-or-later
#include "bake_asset.hpp"

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <exception>
#include <new>
#include <optional>
#include <string>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "sqmap/bake/bake.hpp"
#include "sqmap/io/bundle.hpp"

#include "determinism.hpp"
#include "mesh_size.hpp"
#include "worker_pool.hpp"

namespace sqmap::apps {
namespace {

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

// Error target of the fallback, in percent of R_max: coarse, so that it costs little.
constexpr double kFallbackError_percent = 2;

/// As plain as libbake gets: one superquadric for the whole mesh, a coarse map.
bake::BakeOptions fallback_options(bake::BakeOptions options) {
  options.max_error_percent = std::max(options.max_error_percent, kFallbackError_percent);
  options.max_error_m = 0;
  options.max_parts = 1;
  options.decompose.join_components = true;
  options.fit.quick = true;
  options.sample_count = std::min(options.sample_count, std::uint32_t{2000});
  return options;
}

/// Marks the bundle: who finds it later must be able to tell.
void mark_fallback(Provenance& provenance) {
  auto options = nlohmann::json::parse(provenance.options_json);
  options["fallback"] = "superquadric";
  provenance.options_json = options.dump();
}

/// Bytes of a file name that are not UTF-8 become U+FFFD: a bundle holds no other text.
std::string as_utf8(const std::string& name) {
  using Json = nlohmann::json;
  return Json::parse(Json(name).dump(-1, ' ', false, Json::error_handler_t::replace)).get<std::string>();
}

std::optional<Error> bake_into(BakeProduct& product, const BakeJob& job, const AssetOptions& asked,
                               const bake::Progress& progress) {
  BakeRecord& record = product.record;
  progress.at("read", 0);
  const Clock::time_point read_start = Clock::now();
  Result<bake::SourceMesh> source = bake::read_mesh(job.input, asked.bake.read);
  if (!source) return source.error();
  source.value().name = as_utf8(source.value().name);
  record.times.push_back({"read", seconds_since(read_start)});
  if (const auto warning = size_warning(source.value().mesh)) record.warnings.push_back(*warning);

  const bake::BakeOptions options = job.is_fallback ? fallback_options(asked.bake) : asked.bake;
  Result<bake::BakeResult> result = bake::bake(source.value(), options, progress);
  if (!result) return result.error();
  Asset& asset = result.value().asset;
  if (job.is_fallback) mark_fallback(asset.provenance);
  for (bake::StageTime& time : result.value().times) record.times.push_back(std::move(time));
  record.describe(asset);
  record.stopped_by = result.value().stopped_by;
  if (const std::uint32_t holes = asset.mesh.filled_holes; holes > 0)
    record.warnings.push_back(fmt::format(
        "{} hole{} in the mesh filled, where the surface is a guess; --repair safe leaves holes open", holes,
        holes == 1 ? "" : "s"));
  record.fits = result.value().fits;
  if (!asset.mesh.is_closed)
    record.degradations.push_back(
        {"open-mesh",
         fmt::format("{} edges with one face and {} with more than two remain; inside is where the "
                     "winding number exceeds 1/2",
                     asset.mesh.boundary_edges, asset.mesh.non_manifold_edges)});

  progress.at("encode", 0);
  const Clock::time_point encode_start = Clock::now();
  Result<std::vector<std::uint8_t>> bytes = io::encode(asset);
  if (!bytes) return bytes.error();
  record.times.push_back({"encode", seconds_since(encode_start)});
  product.bundle = std::move(bytes).value();
  record.bytes = product.bundle.size();
  return std::nullopt;
}

BakeProduct bake_once(const BakeJob& job, unsigned threads, const bake::Progress& progress) {
  BakeProduct product;
  BakeRecord& record = product.record;
  run_jobs(1, threads, [&](std::size_t) {
    try {
      const Result<AssetOptions> options = options_from(job.settings);
      record.error = options ? bake_into(product, job, options.value(), progress) : options.error();
      if (record.error)
        record.verdict = record.error->status == Status::kCancelled ? Verdict::kCancelled : Verdict::kFailed;
    } catch (const std::bad_alloc&) {
      record.verdict = Verdict::kMemory;
      record.error =
          Error{Status::kBakeFailed, "out of memory", "bake fewer meshes at once (-j), or a smaller mesh"};
    } catch (const std::exception& problem) {
      record.verdict = Verdict::kFailed;
      record.error = Error{Status::kBakeFailed, std::string("internal error: ") + problem.what(), ""};
    }
  });
  if (record.error) product.bundle.clear();
  return product;
}

}  // namespace

BakeProduct bake_asset(const BakeJob& job, const bake::Progress& progress) {
  const Clock::time_point start = Clock::now();
  BakeProduct product = bake_once(job, job.threads, progress);
  if (job.verify_determinism && !product.record.error)
    verify_determinism(product, job, [&](unsigned threads) { return bake_once(job, threads, progress); });
  BakeRecord& record = product.record;
  record.input = job.input.string();
  if (!record.error && !record.degradations.empty()) record.verdict = Verdict::kDegraded;
  record.seconds = seconds_since(start);
  return product;
}

}  // namespace sqmap::apps

// SPDX-License-Identifier: GPL-3.0-or-later
#include "bundle_cache.hpp"

#include <algorithm>
#include <array>
#include <cstdlib>
#include <string_view>
#include <system_error>
#include <tuple>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "sqmap/asset/version.hpp"
#include "sqmap/io/bundle.hpp"

#include "../../common/files.hpp"
#include "explain.hpp"

namespace sqmap::apps {
namespace {

namespace fs = std::filesystem;

std::string format_version() { return fmt::format("{}.{}", kFormatMajor, kFormatMinor); }

/// A file as it is now. Not read where its stamp is that of a settled file of the last time.
BakeInput look_at(const fs::path& path, std::string name, const BakeInput* last) {
  if (last != nullptr && last->stamp && stamp_of(path) == last->stamp)
    return {std::move(name), last->hash, last->stamp};
  const std::optional<HashedFile> file = hash_file(path);
  if (!file) return {std::move(name), "", std::nullopt};
  return {std::move(name), file->hash, file->is_settled ? std::optional(file->stamp) : std::nullopt};
}

const BakeInput* last_input(const std::optional<OutputRecord>& last, const std::string& name) {
  if (!last) return nullptr;
  const auto found = std::ranges::find(last->inputs, name, &BakeInput::name);
  return found == last->inputs.end() ? nullptr : &*found;
}

/// What is known before the mesh is imported.
std::string key_of_mesh(const BakeInput& mesh, const BakeIdentity& identity) {
  const std::string format = format_version();
  const std::array<std::string_view, 6> pieces{"sqmap.cache-key/1",   mesh.name,          mesh.hash,
                                               identity.options_json, identity.algorithm, format};
  return content_hash(pieces);
}

/// With the contents of what else the import reads.
std::string key_with_side_files(const std::string& key, std::span<const BakeInput> side_files) {
  std::vector<std::string_view> pieces{key};
  for (const BakeInput& file : side_files) {
    pieces.emplace_back(file.name);
    pieces.emplace_back(file.hash);
  }
  return content_hash(pieces);
}

OutputRecord output_record(const BakeIdentity& identity, std::vector<BakeInput> inputs) {
  return {std::move(inputs), identity.options_json, identity.algorithm, format_version(), "", std::nullopt};
}

std::vector<std::string> miss_reasons(const std::optional<OutputRecord>& last, const OutputRecord& now) {
  if (!last) return {"no earlier bake of this output is on record"};
  std::vector<std::string> lines = differences(*last, now);
  if (lines.empty()) lines.emplace_back("the cache no longer holds the bundle");
  return lines;
}

/// Whether `output` has the contents of the object already.
bool is_current(const fs::path& output, const std::optional<OutputRecord>& last, OutputRecord& now) {
  if (last && last->object == now.object && last->bundle_stamp && stamp_of(output) == last->bundle_stamp) {
    now.bundle_stamp = last->bundle_stamp;
    return true;
  }
  const std::optional<HashedFile> held = hash_file(output);
  if (!held || held->hash != now.object) return false;
  if (held->is_settled) now.bundle_stamp = held->stamp;
  return true;
}

constexpr const char* kUnusable =
    "the cache's copy of the bundle is damaged, missing or cannot be written to the output";
constexpr const char* kUpToDate = "nothing to do: the output is up to date";

Error changed(const std::string& name) {
  return {Status::kInvalidMesh,
          fmt::format("{} changed while it was baked, so the bundle is not cached", name), "bake it again"};
}

}  // namespace

std::optional<fs::path> BundleCache::default_folder() {
  if (const char* given = std::getenv("SQMAP_CACHE_DIR"); given != nullptr)
    return *given == '\0' ? std::nullopt : std::optional<fs::path>(given);
  const auto value = [](const char* name) {
    const char* text = std::getenv(name);
    return text != nullptr ? fs::path(text) : fs::path();
  };
  if (const fs::path base = value("XDG_CACHE_HOME"); base.is_absolute()) return base / "sqmap";
  if (const fs::path home = value("HOME"); home.is_absolute()) return home / ".cache" / "sqmap";
  return std::nullopt;
}

/// What the cache holds for a request, before anything is made of it.
struct BundleCache::Found {
  CacheAnswer answer;  ///< of a hit: the differences to the last bake and the record, not yet is_hit
  std::optional<OutputRecord> last;
  OutputRecord now;  ///< with an object when a result was found
  std::string key;
};

BundleCache::Found BundleCache::find(const CacheRequest& request) const {
  Found found;
  CacheAnswer& answer = found.answer;
  answer.ticket = {request, "", now_ns()};
  found.last = store_.output_record(request.output);
  const std::optional<OutputRecord>& last = found.last;
  const std::string name = request.mesh.filename().string();
  const BakeInput mesh = look_at(request.mesh, name, last_input(last, name));
  if (mesh.hash.empty()) {
    answer.reasons = {"the mesh cannot be read"};
    return found;
  }
  answer.ticket.mesh_hash = mesh.hash;

  found.key = key_of_mesh(mesh, request.identity);
  std::optional<CacheResult> result = store_.result(found.key);
  std::vector<std::string> side_names;
  if (result) {
    side_names = result->side_files;
  } else if (last) {
    for (std::size_t i = 1; i < last->inputs.size(); ++i) side_names.push_back(last->inputs[i].name);
  }
  std::vector<BakeInput> inputs{mesh};
  for (const std::string& side : side_names)
    inputs.push_back(look_at(request.mesh.parent_path() / side, side, last_input(last, side)));
  if (result && !side_names.empty()) {
    found.key = key_with_side_files(found.key, std::span(inputs).subspan(1));
    result = store_.result(found.key);
  }
  found.now = output_record(request.identity, std::move(inputs));
  if (!result || result->object.empty()) {
    answer.reasons = miss_reasons(last, found.now);
    return found;
  }
  found.now.object = result->object;
  answer.record_json = std::move(result->record_json);
  if (last) answer.reasons = differences(*last, found.now);
  return found;
}

CacheAnswer BundleCache::lookup(const CacheRequest& request) const {
  auto [answer, last, now, key] = find(request);
  if (now.object.empty()) return answer;
  if (!is_current(request.output, last, now)) {
    const std::optional<std::vector<std::uint8_t>> bytes = store_.object(now.object);
    if (!bytes || !write_file(request.output, *bytes)) {
      answer.reasons = {kUnusable};
      return answer;
    }
    answer.output_written = true;
  }
  answer.is_hit = true;
  answer.object = now.object;
  answer.reasons.emplace_back(answer.output_written ? "copied from the cache" : kUpToDate);
  store_.mark_used(key);
  if (last != now) std::ignore = store_.put_output_record(request.output, now);  // costs time, not truth
  return answer;
}

CacheAnswer BundleCache::peek(const CacheRequest& request) const {
  auto [answer, last, now, key] = find(request);
  if (now.object.empty()) return answer;
  const bool is_up_to_date = is_current(request.output, last, now);
  answer.is_hit = is_up_to_date || store_.object(now.object);
  if (!answer.is_hit) {
    answer.reasons = {kUnusable};
  } else {
    answer.reasons.emplace_back(is_up_to_date ? kUpToDate : "the cache has it");
  }
  return answer;
}

Outcome BundleCache::publish(const CacheTicket& ticket, std::span<const fs::path> side_files,
                             const std::string& record_json) const {
  const auto& [mesh, output, identity] = ticket.request;
  if (!nlohmann::json::parse(record_json, nullptr, false).is_object())
    return Error{Status::kBadOption, "a cache record must be a JSON object", ""};
  if (ticket.mesh_hash.empty()) return changed(mesh.string());
  const Result<std::vector<std::uint8_t>> bytes = read_file(output, io::ReadLimits{}.max_file_bytes);
  if (!bytes) return bytes.error();
  const Result<Asset> asset = io::decode(bytes.value());
  if (!asset) return asset.error();
  if (asset.value().provenance.source_hash != ticket.mesh_hash) return changed(mesh.string());

  std::vector<BakeInput> inputs{look_at(mesh, mesh.filename().string(), nullptr)};
  if (inputs.front().hash != ticket.mesh_hash) return changed(mesh.string());
  std::error_code code;
  const fs::path folder = fs::absolute(mesh, code).lexically_normal().parent_path();
  std::vector<std::string> names;
  for (const fs::path& file : side_files)
    names.push_back(fs::absolute(file, code).lexically_normal().lexically_relative(folder).string());
  std::ranges::sort(names);
  names.erase(std::unique(names.begin(), names.end()), names.end());
  std::erase(names, inputs.front().name);
  for (const std::string& name : names) {
    const fs::path path = folder / name;
    if (const auto stamp = stamp_of(path); stamp && stamp->ctime_ns >= ticket.asked_at_ns)
      return changed(path.string());
    inputs.push_back(look_at(path, name, nullptr));
  }

  OutputRecord record = output_record(identity, std::move(inputs));
  record.object = content_hash(bytes.value());
  const std::string mesh_key = key_of_mesh(record.inputs.front(), identity);
  std::string key = mesh_key;
  if (!names.empty()) key = key_with_side_files(mesh_key, std::span(record.inputs).subspan(1));
  if (Outcome put = store_.put_object(record.object, bytes.value()); !put) return put;
  if (Outcome put = store_.put_result(key, {{}, record.object, record_json}); !put) return put;
  if (!names.empty())
    if (Outcome put = store_.put_result(mesh_key, {names, "", ""}); !put) return put;
  return store_.put_output_record(output, record);
}

}  // namespace sqmap::apps

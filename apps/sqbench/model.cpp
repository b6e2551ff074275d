// SPDX-License-Identifier: GPL-3.0-or-later
#include "model.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <utility>

#include "sqmap/io/bundle.hpp"

#include "field.hpp"
#include "timing.hpp"

namespace sqmap::bench {
namespace {

Result<bake::SourceMesh> read_source(const std::filesystem::path& mesh, const Provenance& provenance) {
  bake::ReadOptions options;
  options.metres_per_unit = provenance.metres_per_unit;
  options.up = provenance.up_axis == "x"   ? bake::UpAxis::kX
               : provenance.up_axis == "y" ? bake::UpAxis::kY
                                           : bake::UpAxis::kZ;
  return bake::read_mesh(mesh, options);
}

}  // namespace

const Field& Model::field(unsigned resolution) const {
  auto& slot = fields[resolution];
  if (!slot) slot = std::make_shared<Field>(exact_field(*this, resolution));
  return *slot;
}

const std::vector<double>& Model::field_seconds(unsigned resolution) const {
  field(resolution);
  std::vector<double>& seconds = fields[resolution]->seconds;
  while (!is_timed_enough(seconds)) seconds.push_back(exact_field(*this, resolution).seconds.front());
  return seconds;
}

double Model::shared_s() const {
  double sum_s = with_tapers_s;
  for (const auto& [resolution, field] : fields)
    sum_s += std::accumulate(field->seconds.begin(), field->seconds.end(), 0.0);
  for (const auto& [count, kept] : hulls)
    sum_s += std::accumulate(kept.seconds.begin(), kept.seconds.end(), 0.0);
  return sum_s;
}

void Model::find_box() {
  low_m = high_m = mesh.vertices_m.front();
  for (const Vec3d& v : mesh.vertices_m)
    for (int axis = 0; axis < 3; ++axis) {
      low_m[axis] = std::min(low_m[axis], v[axis]);
      high_m[axis] = std::max(high_m[axis], v[axis]);
    }
}

Result<Model> read_model(const std::filesystem::path& mesh, const std::filesystem::path& bundles) {
  Model model;
  model.name = mesh.stem().string();
  const std::filesystem::path bundle = bundles / (model.name + ".h5");
  Result<Asset> asset = io::read(bundle);
  if (!asset) return asset.error();
  model.asset = std::move(asset.value());
  std::error_code ignored;
  model.bundle_bytes = std::filesystem::file_size(bundle, ignored);

  const Result<bake::SourceMesh> source = read_source(mesh, model.asset.provenance);
  if (!source) return source.error();
  if (source.value().hash != model.asset.provenance.source_hash) {
    return Error{Status::kBadOption,
                 bundle.string() + " was baked from a file other than " + mesh.string() + " (hashes " +
                     model.asset.provenance.source_hash + " and " + source.value().hash + ")",
                 "bake the mesh again with sqbake, or name the right folder with --bundles"};
  }
  Result<bake::PreparedMesh> prepared = bake::check_and_repair(source.value());
  if (!prepared) return prepared.error();
  model.mesh = std::move(prepared.value().mesh);
  model.oracle = std::make_unique<bake::Oracle>(model.mesh);
  model.find_box();
  return model;
}

Result<bake::Mesh> read_probe(const std::filesystem::path& path) {
  const Result<bake::SourceMesh> source = bake::read_mesh(path);
  if (!source) return source.error();
  const bake::Mesh& coarse = source.value().mesh;
  bake::Mesh fine;
  fine.vertices_m = coarse.vertices_m;
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles;
  const auto middle = [&](std::uint32_t a, std::uint32_t b) {
    const auto [place, is_new] = middles.try_emplace({std::min(a, b), std::max(a, b)},
                                                     static_cast<std::uint32_t>(fine.vertices_m.size()));
    if (is_new) fine.vertices_m.push_back(0.5 * (coarse.vertices_m[a] + coarse.vertices_m[b]));
    return place->second;
  };
  for (const auto& [a, b, c] : coarse.faces) {
    const std::uint32_t ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
    for (const std::array<std::uint32_t, 3>& face :
         {std::array{a, ab, ca}, std::array{b, bc, ab}, std::array{c, ca, bc}, std::array{ab, bc, ca}})
      fine.faces.push_back(face);
  }
  fine.source_face.assign(fine.faces.size(), bake::kNewFace);

  Vec3d centre;
  double r_max = 0;  // of the coarse vertices: the middles of edges lie between them
  for (std::size_t i = 0; i < coarse.vertices_m.size(); ++i) {
    centre = centre + coarse.vertices_m[i];
    for (std::size_t j = 0; j < i; ++j)
      r_max = std::max(r_max, norm(coarse.vertices_m[i] - coarse.vertices_m[j]));
  }
  centre = (1.0 / static_cast<double>(coarse.vertices_m.size())) * centre;
  for (Vec3d& v : fine.vertices_m) v = (1 / r_max) * (v - centre);
  return fine;
}

}  // namespace sqmap::bench

// SPDX-License-Identifier: GPL-3.0-or-later
#include "baked.hpp"

#include <stdexcept>
#include <utility>

#include <nlohmann/json.hpp>

#include "sqmap/io/bundle.hpp"

#include "timing.hpp"

namespace sqmap::bench {

Model baked_model(const std::string& name, const bake::Mesh& mesh, const bake::BakeOptions& options) {
  bake::SourceMesh source;
  source.mesh = mesh;
  source.mesh.source_face.resize(mesh.faces.size());
  for (std::size_t f = 0; f < mesh.faces.size(); ++f)
    source.mesh.source_face[f] = static_cast<std::uint32_t>(f);
  source.source_face_count = static_cast<std::uint32_t>(mesh.faces.size());
  source.name = name;
  source.hash = std::string(32, '0');  // of a file; there is none
  auto baked = bake::bake(source, options);
  if (!baked) throw std::runtime_error("bake " + name + ": " + baked.error().finding);
  const auto bytes = io::encode(baked.value().asset);
  if (!bytes) throw std::runtime_error("encode " + name + ": " + bytes.error().finding);
  auto prepared = bake::check_and_repair(source, options.repair);
  if (!prepared) throw std::runtime_error(name + ": " + prepared.error().finding);

  Model model;
  model.name = name;
  model.mesh = std::move(prepared.value().mesh);
  model.asset = std::move(baked.value().asset);
  model.bundle_bytes = bytes.value().size();
  model.oracle = std::make_unique<bake::Oracle>(model.mesh);
  model.find_box();
  return model;
}

Model baked_again(const Model& model, const bake::BakeOptions& options) {
  return baked_model(model.name, model.mesh, options);
}

namespace {

/// Those that the bundle was baked to, as it records them.
bake::BakeOptions limits_of(const Provenance& provenance) {
  bake::BakeOptions options;
  const auto recorded = nlohmann::json::parse(provenance.options_json, nullptr, false);
  if (!recorded.is_object()) return options;
  options.max_error_percent = recorded.value("max_error_percent", options.max_error_percent);
  options.max_error_m = recorded.value("max_error_m", options.max_error_m);
  options.max_parts = recorded.value("max_parts", options.max_parts);
  options.max_bytes = recorded.value("max_bytes", options.max_bytes);
  return options;
}

}  // namespace

const Model& Model::tapered() const {
  if (!with_tapers) {
    bake::BakeOptions options = limits_of(asset.provenance);
    options.fit.taper = true;
    const double start_s = wall_s();
    with_tapers = std::make_shared<const Model>(baked_again(*this, options));
    with_tapers_s = wall_s() - start_s;
  }
  return *with_tapers;
}

}  // namespace sqmap::bench

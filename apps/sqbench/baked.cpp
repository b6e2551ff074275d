// SPDX-License-Identifier: GPL-3.0-or-later
#include "baked.hpp"

#include <stdexcept>
#include <utility>

#include "sqmap/io/bundle.hpp"

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

}  // namespace sqmap::bench

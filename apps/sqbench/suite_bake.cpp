// SPDX-License-Identifier: GPL-3.0-or-later
//
// What preparing an object costs, for each accuracy asked for.
#include <algorithm>
#include <limits>
#include <span>
#include <stdexcept>
#include <vector>

#include <fmt/format.h>

#include "sqmap/bake/bake.hpp"
#include "sqmap/io/bundle.hpp"

#include "drawings.hpp"
#include "field.hpp"
#include "suites.hpp"
#include "timing.hpp"

namespace sqmap::bench {
void run_bake(const SuiteInput& input, Results& results) {
  draw_objects(input, results);
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  const std::vector<double> targets = input.is_smoke ? std::vector{1.0} : std::vector{0.5, 0.2, 0.1, 0.05};
  // Bakes are most of a smoke run: those of two objects show that all works.
  const std::size_t objects =
      input.is_smoke ? std::min<std::size_t>(input.models.size(), 2) : input.models.size();
  for (const Model& model : std::span(input.models).first(objects)) {
    for (const double target : targets) {
      input.note(fmt::format("bake: {}, {} %", model.name, target));
      bake::SourceMesh source;
      source.mesh = model.mesh;
      source.source_face_count = static_cast<std::uint32_t>(model.mesh.faces.size());
      source.name = model.name;
      source.hash = model.asset.provenance.source_hash;
      bake::BakeOptions options;
      options.max_error_percent = target;
      std::vector<double> seconds;
      const auto baked = make_timed([&] { return bake::bake(source, options); }, seconds);
      if (!baked) throw std::runtime_error("bake " + model.name + ": " + baked.error().finding);
      const auto bytes = io::encode(baked.value().asset);
      if (!bytes) throw std::runtime_error("encode " + model.name + ": " + bytes.error().finding);
      double reached = kNan;
      for (const ErrorRow& row : baked.value().asset.errors)
        if (row.level == 0 && row.layer == 2) reached = row.eq35_percent;
      results.bake.push_back({model.name, "sqmap", target, spread_of(seconds),
                              static_cast<double>(bytes.value().size()), reached,
                              baked.value().asset.parts.size()});
    }
    for (const unsigned resolution : {32U, 64U, 128U}) {
      results.bake.push_back({model.name, fmt::format("exact-field-{}", resolution), kNan,
                              spread_of(model.field_seconds(resolution)),
                              static_cast<double>(model.field(resolution).distance_m.size() * sizeof(float)),
                              kNan, 0});
    }
  }
}

}  // namespace sqmap::bench

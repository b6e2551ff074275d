// SPDX-License-Identifier: GPL-3.0-or-later
#include "mesh_options.hpp"

#include <algorithm>
#include <map>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "quantities.hpp"

namespace sqmap::apps {
namespace {

const std::map<std::string, bake::UpAxis> kUpNames{
    {"x", bake::UpAxis::kX}, {"y", bake::UpAxis::kY}, {"z", bake::UpAxis::kZ}};
const std::map<std::string, bake::Repair> kRepairNames{
    {"none", bake::Repair::kNone}, {"safe", bake::Repair::kSafe}, {"all", bake::Repair::kAll}};

// Haptic and game objects lie far inside this range; outside it the usual cause is millimetres read as
// metres.
constexpr double kSmallestUsual_m = 1e-3;
constexpr double kLargestUsual_m = 1e3;

}  // namespace

void add_mesh_options(CLI::App& app, MeshOptions& options) {
  app.add_option_function<std::string>(
         "--unit",
         [&options](const std::string& text) {
           const Result<double> metres = parse_unit(text);
           if (!metres) throw CLI::ValidationError("--unit", metres.error().finding);
           options.read.metres_per_unit = metres.value();
         },
         "Unit of the coordinates: m, cm, mm, um, in, ft or a number of metres\n(default m)")
      ->type_name("UNIT");
  app.add_option("--up", options.read.up,
                 "Axis of the input that points up: x, y, z; turned to z (default z)")
      ->transform(CLI::CheckedTransformer(kUpNames).description(""))
      ->type_name("AXIS");
  app.add_option("--repair", options.repair.policy,
                 "none: drop only faces without area; safe: also weld, drop duplicates,\norient; "
                 "all: also fill small holes (default all)")
      ->transform(CLI::CheckedTransformer(kRepairNames).description(""))
      ->type_name("POLICY");
}

double diagonal_m(const bake::Mesh& mesh) {
  if (mesh.vertices_m.empty()) return 0;
  Vec3d low = mesh.vertices_m.front(), high = low;
  for (const Vec3d& v : mesh.vertices_m) {
    for (int axis = 0; axis < 3; ++axis) {
      low[axis] = std::min(low[axis], v[axis]);
      high[axis] = std::max(high[axis], v[axis]);
    }
  }
  return norm(high - low);
}

std::optional<std::string> size_warning(const bake::Mesh& mesh) {
  const double size_m = diagonal_m(mesh);
  if (size_m >= kSmallestUsual_m && size_m <= kLargestUsual_m) return std::nullopt;
  return fmt::format("the object is {:.3g} m across; if that is wrong, give the unit with --unit", size_m);
}

}  // namespace sqmap::apps

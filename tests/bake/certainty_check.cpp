// SPDX-License-Identifier: GPL-3.0-or-later
// certainty_check BUNDLE.h5 MESH COUNT: asks a conservative bundle for the certainty of COUNT points of each
// kind and compares with winding numbers of the mesh. Exit code 1 where a sure answer is wrong by more than
// the bundle's tolerance or layers 2 and 3 contradict one, 2 where the files cannot be used.
// scripts/check_certainty runs it on the samples.
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <string>

#include "sqmap/io/bundle.hpp"

#include "support/certainty_points.hpp"

namespace {

using namespace sqmap;

int refuse(const Error& error) {
  std::fprintf(stderr, "certainty_check: error: %s; %s\n", error.finding.c_str(), error.remedy.c_str());
  return 2;
}

int check(const std::filesystem::path& bundle, const std::filesystem::path& mesh_path, std::size_t count) {
  const auto asset = io::read(bundle);
  if (!asset) return refuse(asset.error());
  const Provenance& origin = asset.value().provenance;
  bake::ReadOptions read;
  read.metres_per_unit = origin.metres_per_unit;
  read.up = origin.up_axis == "x"   ? bake::UpAxis::kX
            : origin.up_axis == "y" ? bake::UpAxis::kY
                                    : bake::UpAxis::kZ;
  const auto source = bake::read_mesh(mesh_path, read);
  if (!source) return refuse(source.error());
  if (source.value().hash != origin.source_hash)
    return refuse({Status::kInvalidMesh, bundle.string() + " was not baked from " + mesh_path.string(),
                   "give the mesh it was baked from"});
  const auto prepared = bake::check_and_repair(source.value());
  if (!prepared) return refuse(prepared.error());
  const auto object = runtime::Object::build(asset.value());
  if (!object) return refuse(object.error());
  const double tolerance_m = object.value().certainty_tolerance_m(), r_max_m = asset.value().r_max_m;
  if (std::isnan(tolerance_m))
    return refuse({Status::kInvalidAsset, bundle.string() + " has no bounds", "bake with --conservative on"});

  const bake::Mesh& mesh = prepared.value().mesh;
  const bake::Oracle oracle(mesh);
  struct Kind {
    const char* name;
    std::vector<Vec3f> points;
  };
  const Kind kinds[] = {{"box", test::points_in_box(mesh, count, 1)},
                        {"shell of 3 %", test::points_in_shell(mesh, 0.03 * r_max_m, count, 2)},
                        {"shell of 0.5 %", test::points_in_shell(mesh, 0.005 * r_max_m, count, 3)},
                        {"adverse", test::adverse_points(mesh, r_max_m, count, 4)}};
  std::size_t wrong = 0;
  for (const Kind& kind : kinds) {
    const test::CertaintyCount found = test::count_certainty(object.value(), oracle, kind.points);
    std::printf("%-14s %-15s %9zu %9zu %9zu %8.2f %6zu %12.2e %12.2e %12zu\n", source.value().name.c_str(),
                kind.name, found.points, found.outside, found.inside, 100 * found.sure_share(), found.wrong,
                found.worst_m / r_max_m, tolerance_m / r_max_m, found.contradicted);
    wrong += found.wrong + found.contradicted;
  }
  return wrong == 0 ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv) {
  const long long count = argc == 4 ? std::atoll(argv[3]) : 0;
  if (count < 1) {
    std::fprintf(stderr, "usage: certainty_check BUNDLE.h5 MESH COUNT\n");
    return 2;
  }
  return check(argv[1], argv[2], static_cast<std::size_t>(count));
}

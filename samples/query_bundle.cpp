// SPDX-License-Identifier: Apache-2.0
// query_bundle BUNDLE.h5: reads points "x y z" in metres, prints what a tool at each point would feel.
#include <cstdio>

#include "sqmap/io/bundle.hpp"
#include "sqmap/runtime/force.hpp"
#include "sqmap/runtime/object.hpp"

int main(int argc, char** argv) {
  const auto asset = sqmap::io::read(argc == 2 ? argv[1] : "");
  if (!asset) return std::fprintf(stderr, "query_bundle: %s\n", asset.error().finding.c_str()), 1;
  const auto object = sqmap::runtime::Object::build(asset.value());
  if (!object) return std::fprintf(stderr, "query_bundle: %s\n", object.error().finding.c_str()), 1;
  sqmap::Vec3f p;
  while (std::scanf("%f %f %f", &p.x, &p.y, &p.z) == 3) {
    const auto answer = object.value().query(p);  // noexcept, allocates nothing; NaN: nothing is near
    const auto f = sqmap::runtime::reaction_force(answer, 500.0F);  // spring of 500 N/m
    std::printf("distance %.4f m  normal %.3f %.3f %.3f  force %.2f %.2f %.2f N\n", answer.signed_distance_m,
                answer.normal.x, answer.normal.y, answer.normal.z, f.x, f.y, f.z);
  }
}

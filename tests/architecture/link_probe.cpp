// SPDX-License-Identifier: Apache-2.0
// A program that links sqmap::runtime alone and calls all that it offers. It prints the distances to a ball
// of radius 0.4 m that link_probe_test.py and install_test.py expect.
#include <array>
#include <cstdio>

#include "sqmap/runtime/contacts.hpp"
#include "sqmap/runtime/force.hpp"
#include "sqmap/runtime/instance.hpp"
#include "sqmap/runtime/object.hpp"
#include "sqmap/runtime/sweep.hpp"

#include "sphere_asset.hpp"

int main() {
  const auto object = sqmap::runtime::Object::build(sqmap::test::sphere_asset());
  if (!object) {
    std::fprintf(stderr, "link_probe: %s\n", object.error().finding.c_str());
    return 1;
  }
  const std::array<sqmap::Vec3f, 3> points_m{{{0.3F, 0, 0}, {0, 0.45F, 0}, {0, 0, 2}}};
  std::array<float, 3> distances_m{};
  sqmap::runtime::Answers answers;
  answers.signed_distance_m = distances_m;
  object.value().query(points_m, answers);
  for (const sqmap::Vec3f& p_m : points_m) {
    const auto answer = object.value().query(p_m);
    const auto force_n = sqmap::runtime::reaction_force(answer, 100.0F);
    std::printf("%d %.3f %.2f %.2f %.2f\n", answer.inside ? 1 : 0, answer.signed_distance_m, force_n.x,
                force_n.y, force_n.z);
  }
  std::printf("%.3f %.3f %.3f\n", distances_m[0], distances_m[1], distances_m[2]);

  // The ball at (1, 0, 0) and a point that flies 2 m to its centre.
  const auto sweeper = sqmap::runtime::Sweeper::build(sqmap::test::sphere_asset());
  const auto instance =
      sqmap::runtime::Instance::place(object.value(), sqmap::runtime::Placement{{{}, {1, 0, 0}}});
  if (!sweeper || !instance) return 1;
  const auto first = sqmap::runtime::first_contact(instance.value(), points_m);
  const auto met = sweeper.value().sweep(instance.value(), {{3, 0, 0}, {1, 0, 0}});
  std::printf("%d %.1f\n", first ? 1 : 0, met.time);
}

// SPDX-License-Identifier: Apache-2.0
// A program with one effect, for the test that looks at what it links. Exit code 0 when a contact pushes.
#include "sqmap/runtime/effects/force_model.hpp"
#include "sqmap/runtime/effects/reaction.hpp"

#include "touch_shapes.hpp"

int main() {
  sqmap::runtime::ForceModel model(sqmap::runtime::Reaction{});
  if (!model.prepare(1)) return 1;
  return sqmap::test::apply_one(model, sqmap::test::plane_contact({0, 0, -0.01F})).force_n.z > 0 ? 0 : 1;
}

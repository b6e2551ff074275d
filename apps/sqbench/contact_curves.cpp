// SPDX-License-Identifier: GPL-3.0-or-later
#include "contact_curves.hpp"

#include <algorithm>
#include <cstddef>
#include <span>
#include <stdexcept>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "sqmap/runtime/body.hpp"
#include "sqmap/runtime/effects/force_model.hpp"
#include "sqmap/runtime/effects/friction.hpp"
#include "sqmap/runtime/effects/impact_zones.hpp"
#include "sqmap/runtime/effects/reaction.hpp"
#include "sqmap/runtime/instance.hpp"
#include "sqmap/runtime/object.hpp"

#include "peer.hpp"
#include "pose_of.hpp"
#include "timing.hpp"
#include "work.hpp"

namespace sqmap::bench {
namespace {

template <class T>
T value_of(Result<T> result) {
  if (!result) throw std::runtime_error(result.error().finding);
  return std::move(result).value();
}

/// One pose after the other, all contestants by turns in each.
void add_curves(const char* figure, const Model& model, const std::vector<Contestant>& contestants,
                const std::vector<double>& x, std::size_t repetitions, Results& results) {
  std::vector<CurveRow> rows;
  for (const Contestant& contestant : contestants)
    rows.push_back({figure, model.name, contestant.name, {}, {}});
  for (std::size_t pose = 0; pose < x.size(); ++pose) {
    std::vector<Contestant> here;
    for (const Contestant& contestant : contestants)
      here.push_back({contestant.name, [&, pose](std::size_t) { return contestant.run(pose); }});
    const std::vector<Timing> timings = measure(here, 1, repetitions);
    for (std::size_t c = 0; c < rows.size(); ++c) rows[c].add(x[pose], timings[c].spread(1e6));
  }
  for (CurveRow& row : rows) results.curves.push_back(std::move(row));
}

void run_slide(const SuiteInput& input, const Model& model, const Probe& probe, Results& results) {
  const Sequence slide = make_sequence(model, probe, Contact::kTouching, input.is_smoke ? 8 : 120);
  const runtime::Object object = value_of(runtime::Object::build(model.asset));
  const runtime::Instance instance = value_of(runtime::Instance::place(object, runtime::Placement{}));
  const runtime::PointBody body = value_of(runtime::PointBody::build(probe.cloud.points_m));
  const runtime::ContactQuery query{{runtime::Layer::kThree, 0, 0}, 0};
  runtime::ForceModel model_of_force(runtime::Reaction{kStiffness_n_per_m}, runtime::Friction{},
                                     runtime::ImpactZones{});
  if (const Outcome ready = model_of_force.prepare(probe.cloud.count); !ready)
    throw std::runtime_error(ready.error().finding);

  std::vector<runtime::Contact> contacts(probe.cloud.count);
  std::vector<Vec3f> force_n(probe.cloud.count);
  const auto collide = [&](std::size_t pose) {
    return object.contacts(body, {pose_of(slide.object_from_probe[pose]), 1}, contacts, query);
  };
  // Effects want contacts in the order of the points.
  const auto push = [&](std::size_t count) {
    const auto found = std::span(contacts).first(count);
    std::sort(found.begin(), found.end(), [](const auto& a, const auto& b) { return a.point < b.point; });
    runtime::Touches touches{{&instance, query.options}, {}, found, std::span(force_n).first(count)};
    return std::size_t{model_of_force.apply(touches).contacts};
  };
  std::vector<double> x;
  std::vector<std::vector<runtime::Contact>> found;
  for (std::size_t pose = 0; pose < slide.object_from_probe.size(); ++pose) {
    x.push_back(static_cast<double>(pose));
    const std::size_t count = collide(pose);
    found.emplace_back(contacts.begin(), contacts.begin() + static_cast<std::ptrdiff_t>(count));
  }
  add_curves("14a", model,
             {{"collision detection (layer 3)", collide},
              {"reaction, friction, impact zone",
               [&](std::size_t pose) {
                 std::copy(found[pose].begin(), found[pose].end(), contacts.begin());
                 return push(found[pose].size());
               }},
              {"both", [&](std::size_t pose) { return push(collide(pose)); }}},
             x, input.is_smoke ? 3 : 9, results);
}

void run_press(const SuiteInput& input, const Model& model, const Probe& probe, Results& results) {
  std::vector<std::pair<std::ptrdiff_t, Placement>> by_contacts;  // deeper poses need not have more
  for (const Placement& placement : make_press(model, probe, input.is_smoke ? 4 : 20))
    by_contacts.emplace_back(
        std::count_if(probe.cloud.points_m.begin(), probe.cloud.points_m.end(),
                      [&](const Vec3f& p) { return model.oracle->inside(cast<double>(placement.apply(p))); }),
        placement);
  std::stable_sort(by_contacts.begin(), by_contacts.end(),
                   [](const auto& a, const auto& b) { return a.first < b.first; });
  std::vector<double> x;
  std::vector<Placement> press;
  for (const auto& [inside, placement] : by_contacts) {
    x.push_back(static_cast<double>(inside));
    press.push_back(placement);
  }
  const auto layer_2 = make_sqmap(model, 2, 0), layer_3 = make_sqmap(model, 3, 0),
             grid = make_grid(model, GridCode::kInt16SimdCulled, 128), bricks = make_bricks(model, 128),
             paper = make_paper(model, 100, 200, 0);
  const auto tree = make_fcl(model, probe.mesh, FclTree::kObb, false);
  Hits hits(probe.cloud.count);
  const auto asks = [&](const char* name, const Peer& peer) -> Contestant {
    return {name, [&](std::size_t pose) {
              peer.answer(probe.cloud, press[pose], hits);
              return hits.count;
            }};
  };
  add_curves("14b", model,
             {asks("sqmap-layer2", *layer_2),
              asks("sqmap-layer3", *layer_3),
              asks(kReference, *grid),
              asks(kBricks, *bricks),
              asks("paper-100x200-layer2", *paper),
              {kTreeReference, [&](std::size_t pose) { return tree->contacts(press[pose]); }}},
             x, input.is_smoke ? 3 : 9, results);
}

}  // namespace

void run_contact_curves(const SuiteInput& input, const Model& model, Results& results) {
  input.note(fmt::format("frames: {}, pose by pose", model.name));
  const Probe probe = scaled_probe(input.probe, model);
  run_slide(input, model, probe, results);
  run_press(input, model, probe, results);
}

}  // namespace sqmap::bench

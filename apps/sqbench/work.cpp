// SPDX-License-Identifier: GPL-3.0-or-later
#include "work.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>

#include "field.hpp"
#include "grid_kernels.hpp"

namespace sqmap::bench {
namespace {

using std::numbers::pi;

/// [0, 1) from 53 bits: unlike the standard distributions, the same on every library.
double uniform(std::mt19937_64& engine) { return static_cast<double>(engine() >> 11) * 0x1.0p-53; }

Quaternion random_turn(std::mt19937_64& engine) {  // Shoemake 1992
  const double u = uniform(engine), a = 2 * pi * uniform(engine), b = 2 * pi * uniform(engine);
  return {std::sqrt(u) * std::cos(b), std::sqrt(1 - u) * std::sin(a), std::sqrt(1 - u) * std::cos(a),
          std::sqrt(u) * std::sin(b)};
}

constexpr unsigned kSearchResolution = 128;
constexpr double kTouch = 0.01;     ///< depth of touching poses, of R_max
constexpr double kDeepest = 0.027;  ///< of grasps; the band is 0.03, the search grid wrong by up to 0.003
constexpr double kGraspContacts = 440;

/// Poses are searched with a grid and measured with the oracle afterwards.
class Search {
 public:
  Search(const Model& model, const Probe& probe)
      : model_(model), probe_(probe), field_(model.field(kSearchResolution)) {}

  struct State {
    double least_m = std::numeric_limits<double>::infinity();  ///< signed distance
    std::size_t contacts{};
  };
  State at(const Placement& placement) const {
    State state;
    for (const Vec3f& p : probe_.cloud.points_m) {
      const Vec3d q = cast<double>(placement.apply(p));
      Vec3d within = q;
      for (int axis = 0; axis < 3; ++axis)
        within[axis] = std::clamp(q[axis], model_.low_m[axis], model_.high_m[axis]);
      // Outside the box a lower bound, as the way on from it to the object turns by a right angle or more.
      const double outside_m = norm(q - within), from_box_m = field_.sample(within);
      const double d = outside_m > 0 ? std::hypot(outside_m, std::max(0.0, from_box_m)) : from_box_m;
      state.least_m = std::min(state.least_m, d);
      if (d < 0) ++state.contacts;
    }
    return state;
  }

  /// Moves the probe from far away against `direction` until its deepest point is at signed distance
  /// `target_m`.
  Placement approach(const Rotation<float>& turn, const Vec3d& direction, double target_m) const {
    const double step_m = 0.004 * model_.r_max_m();
    double out_m = 2 * model_.r_max_m();
    const auto placed = [&](double distance_m) {
      return Placement{turn, cast<float>(centre() + distance_m * direction)};
    };
    while (out_m > 0) {
      const double least_m = at(placed(out_m)).least_m;
      if (least_m < target_m) break;
      out_m -= std::max(step_m, 0.9 * (least_m - target_m));
    }
    double low_m = out_m, high_m = out_m + step_m;
    for (int i = 0; i < 12; ++i) {
      const double middle_m = (low_m + high_m) / 2;
      (at(placed(middle_m)).least_m < target_m ? low_m : high_m) = middle_m;
    }
    return placed(high_m);
  }

  Vec3d centre() const { return 0.5 * (model_.low_m + model_.high_m); }

 private:
  const Model& model_;
  const Probe& probe_;
  const Field& field_;
};

/// Direction and turn on a spiral from pole to pole, so that neighbouring poses are alike.
Vec3d spiral(double t) {
  const double z = 0.9 * (1 - 2 * t), angle = 2 * pi * 5 * t;
  const double r = std::sqrt(1 - z * z);
  return {r * std::cos(angle), r * std::sin(angle), z};
}

bool boxes_overlap(const Model& model, const Probe& probe, const Placement& placement) {
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  Vec3f low{kInfinity, kInfinity, kInfinity}, high = -low;
  for (const Vec3f& p : probe.cloud.points_m) {
    const Vec3f q = placement.apply(p);
    for (int axis = 0; axis < 3; ++axis) {
      low[axis] = std::min(low[axis], q[axis]);
      high[axis] = std::max(high[axis], q[axis]);
    }
  }
  for (int axis = 0; axis < 3; ++axis)
    if (low[axis] > model.high_m[axis] || high[axis] < model.low_m[axis]) return false;
  return true;
}

std::vector<Placement> search(const Model& model, const Probe& probe, Contact contact, std::size_t poses) {
  const Search search(model, probe);
  const double r_max_m = model.r_max_m();
  std::mt19937_64 engine(kSeed + static_cast<std::uint64_t>(contact));
  const Quaternion first = random_turn(engine);
  std::vector<Placement> found;
  if (contact == Contact::kTouching) {
    for (std::size_t i = 0; i < poses; ++i) {
      const double t = (static_cast<double>(i) + 0.5) / static_cast<double>(poses);
      const double half = pi * t;
      const Quaternion turn{first.w * std::cos(half) - first.z * std::sin(half),
                            first.x * std::cos(half) - first.y * std::sin(half),
                            first.y * std::cos(half) + first.x * std::sin(half),
                            first.z * std::cos(half) + first.w * std::sin(half)};
      found.push_back(search.approach(rotation<float>(turn), spiral(t), -kTouch * r_max_m));
    }
    return found;
  }
  if (contact == Contact::kFar) {
    for (int tries = 0; found.size() < poses && tries < 1000; ++tries) {
      const auto turn = rotation<float>(random_turn(engine));
      const Vec3d direction = spiral(uniform(engine));
      // Half a per cent more than the band, for the error of the search grid.
      const Placement there = search.approach(turn, direction, (kBand + 0.015) * r_max_m);
      if (boxes_overlap(model, probe, there)) found.push_back(there);
    }
    return found;
  }
  struct Candidate {
    double misses;
    Placement placement;
  };
  std::vector<Candidate> candidates;
  for (std::size_t i = 0; i < 12 * poses; ++i) {
    const auto turn = rotation<float>(random_turn(engine));
    const Placement there = search.approach(turn, spiral(uniform(engine)), -kDeepest * r_max_m);
    candidates.push_back({std::abs(static_cast<double>(search.at(there).contacts) - kGraspContacts), there});
  }
  std::stable_sort(candidates.begin(), candidates.end(),
                   [](const Candidate& a, const Candidate& b) { return a.misses < b.misses; });
  for (std::size_t i = 0; i < poses; ++i) found.push_back(candidates[i].placement);
  return found;
}

}  // namespace

Probe scaled_probe(const bake::Mesh& unit, const Model& model) {
  bake::Mesh mesh = unit;
  for (Vec3d& v : mesh.vertices_m) v = kProbeSize * model.r_max_m() * v;
  Cloud cloud(mesh.vertices_m);
  return {std::move(mesh), std::move(cloud)};
}

const char* name_of(Contact contact) noexcept {
  return contact == Contact::kTouching ? "touching" : contact == Contact::kFar ? "far" : "grasp";
}

Sequence make_sequence(const Model& model, const Probe& probe, Contact contact, std::size_t poses) {
  Sequence sequence;
  sequence.contact = contact;
  sequence.object_from_probe = search(model, probe, contact, poses);
  double least_m = std::numeric_limits<double>::infinity();
  std::size_t contacts = 0, near = 0;
  const double band_m = kBand * model.r_max_m();
  const double margin_m = 3 * band_m;  // the nearest point of a probe that is far is beyond the band
  for (const Placement& placement : sequence.object_from_probe)
    for (const Vec3f& p : probe.cloud.points_m) {
      const Vec3d q = cast<double>(placement.apply(p));
      bool is_near = true;
      for (int axis = 0; axis < 3; ++axis)
        is_near =
            is_near && q[axis] >= model.low_m[axis] - margin_m && q[axis] <= model.high_m[axis] + margin_m;
      if (!is_near) continue;
      const double d = model.oracle->signed_distance(q);
      least_m = std::min(least_m, d);
      if (d < 0) ++contacts;
      if (std::abs(d) <= band_m) ++near;
    }
  const auto count = static_cast<double>(std::max<std::size_t>(sequence.object_from_probe.size(), 1));
  sequence.contacts_mean = static_cast<double>(contacts) / count;
  sequence.near_mean = static_cast<double>(near) / count;
  sequence.nearest_percent = 100 * least_m / model.r_max_m();
  sequence.deepest_percent = std::max(0.0, -sequence.nearest_percent);
  return sequence;
}

std::vector<Placement> make_press(const Model& model, const Probe& probe, std::size_t poses) {
  constexpr double kFirst = 0.01, kLast = -0.2;
  const Search search(model, probe);
  std::mt19937_64 engine(kSeed);
  const auto turn = rotation<float>(random_turn(engine));
  std::vector<Placement> press;
  for (std::size_t i = 0; i < poses; ++i) {
    const double t = static_cast<double>(i) / static_cast<double>(std::max<std::size_t>(poses - 1, 1));
    press.push_back(search.approach(turn, spiral(0.5), (kFirst + t * (kLast - kFirst)) * model.r_max_m()));
  }
  return press;
}

Shell make_shell(const Model& model, double share, std::size_t count) {
  std::mt19937_64 engine(kSeed + static_cast<std::uint64_t>(share * 1e4));
  const auto& mesh = model.mesh;
  std::vector<double> area_to;
  double area = 0;
  for (const auto& [a, b, c] : mesh.faces) {
    area += norm(cross(mesh.vertices_m[b] - mesh.vertices_m[a], mesh.vertices_m[c] - mesh.vertices_m[a]));
    area_to.push_back(area);
  }
  Shell shell;
  shell.share = share;
  while (shell.points_m.size() < count) {
    const double pick = area * uniform(engine);
    const auto place = std::min<std::size_t>(
        static_cast<std::size_t>(std::upper_bound(area_to.begin(), area_to.end(), pick) - area_to.begin()),
        mesh.faces.size() - 1);
    const auto& [a, b, c] = mesh.faces[place];
    const double root = std::sqrt(uniform(engine)), v = uniform(engine);
    const Vec3d ab = mesh.vertices_m[b] - mesh.vertices_m[a], ac = mesh.vertices_m[c] - mesh.vertices_m[a];
    const Vec3d on = mesh.vertices_m[a] + root * (1 - v) * ab + root * v * ac;
    const double along_m = share * model.r_max_m() * (2 * uniform(engine) - 1);
    // Peers see the point in float: the truth must be that of the same point.
    const Vec3d p = cast<double>(cast<float>(on + along_m * normalized(cross(ab, ac))));
    const auto nearest = model.oracle->nearest(p);
    if (!(nearest.distance_m <= share * model.r_max_m())) continue;
    const double sign = model.oracle->inside(p) ? -1 : 1;
    shell.points_m.push_back(p);
    shell.distance_m.push_back(sign * nearest.distance_m);
    shell.normal.push_back(normalized(sign * (p - nearest.nearest_m)));
  }
  return shell;
}

}  // namespace sqmap::bench

// SPDX-License-Identifier: Apache-2.0
#include "sqmap/runtime/sweep.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "sqmap/asset/validate.hpp"

#include "sweep_path.hpp"

namespace sqmap::runtime {

Result<Sweeper> Sweeper::build(const Asset& asset) {
  const auto findings = validate(asset, CheckLevel::kQuick);
  if (!findings.empty()) {
    return Error{Status::kInvalidAsset, findings.front().message, "bake the mesh again"};
  }
  Sweeper sweeper;
  sweeper.sphere_ = asset.sphere;
  sweeper.r_max_m_ = asset.r_max_m;
  sweeper.bodies_.reserve(asset.parts.size());
  for (const Part& part : asset.parts) {
    const Vec3d& a_m = part.shape.semi_axes_m;
    const double narrowest = (1 - std::abs(part.shape.taper)) * (1 - bend_reach(part.shape));
    const double least_m = narrowest * std::min({a_m.x, a_m.y, a_m.z});
    const double reach_m = norm(part.object_from_part.translation_m) + part.sphere.radius_m;
    // Four roundings of the coordinates, seen across the thinnest direction; 16 of beta itself.
    const double skin = std::numeric_limits<float>::epsilon() * std::max(4 * reach_m / least_m, 16.0);
    sweeper.bodies_.push_back({part.shape, rotation(part.object_from_part.orientation),
                               part.object_from_part.translation_m, part.sphere, std::min(skin, 0.25)});
  }
  for (const ErrorRow& row : asset.errors) {
    if (row.depth_p95_percent >= 0)  // NaN: not measured
      sweeper.declared_.push_back({row.level, row.layer, row.depth_p95_percent / 100 * asset.r_max_m});
  }
  return sweeper;
}

double Sweeper::declared_error_m(const QueryOptions& options) const noexcept {
  // kAuto mixes layers 2 and 3. A level without a row: the coarsest before it.
  double error_m = -1;
  std::uint32_t nearest = 0;
  for (const Declared& row : declared_) {
    const bool is_asked =
        options.layer == Layer::kAuto || row.layer == static_cast<std::uint32_t>(options.layer);
    if (!is_asked || row.level > options.level || row.level < nearest) continue;
    error_m = row.level > nearest ? row.error_m : std::max(error_m, row.error_m);
    nearest = row.level;
  }
  return error_m < 0 ? kUndeclaredError * r_max_m_ : error_m;
}

std::size_t Sweeper::resident_bytes() const noexcept {
  return sizeof(Sweeper) + bodies_.capacity() * sizeof(Body) + declared_.capacity() * sizeof(Declared);
}

/// One point's way along its path.
class SweepRun {
 public:
  SweepRun(const Sweeper& sweeper, const Instance& start, const SweepPath& path,
           const SweepOptions& options) noexcept
      : sweeper_(sweeper), start_(start), path_(path), query_(start.options_in_object(options.query)) {
    const double scale = start.scale();
    tolerance_m_ = options.tolerance_m > 0 ? options.tolerance_m / scale : kSweepTolerance * sweeper.r_max_m_;
    error_m_ = options.error_m >= 0 ? options.error_m / scale : sweeper.declared_error_m(options.query);
    max_steps_ = std::min(options.max_steps, std::uint32_t{std::numeric_limits<std::uint16_t>::max()});
  }

  SweepResult run() noexcept {
    SweepResult result;
    double t = 0;
    double clear = 0;    // the latest place that was looked at and found free
    bool proven = true;  // nothing can lie between `clear` and t
    while (result.steps < max_steps_) {
      ++result.steps;
      const SweepPath::State state = path_.at(t);
      Look look = look_at(state);
      if (look.contact) {
        if (!proven && is_past(look.answer)) {
          t = first_contact_after(clear, t);
          look = look_at(path_.at(t));
        }
        return contact_at(t, look.answer, result);
      }
      if (t >= 1) return clear_path(result);
      clear = t;
      proven = look.proven;
      // Below the resolution of t nothing moves any more.
      t = std::max(t + look.free_time, std::nextafter(t, 2.0));
      if (t > 1 && proven) return clear_path(result);
      t = std::min(t, 1.0);
    }
    result.status = SweepStatus::kUnresolved;
    result.time = rounded_down(t);
    return result;
  }

 private:
  /// What one place of the path tells.
  struct Look {
    bool contact = false;
    bool proven = true;  ///< free_time rests on superquadrics alone
    double free_time = std::numeric_limits<double>::infinity();
    Answer answer;  ///< of the contact
  };
  /// How a part's superquadric lies to the point.
  enum class Side { kOutside, kSkin, kWithin };
  struct Relation {
    Side side;
    double free_time;  ///< outside
    double beta;
    Vec3d p_part_m;
  };

  static float rounded_down(double t) noexcept {
    const auto rounded = static_cast<float>(t);
    return rounded > t ? std::nextafter(rounded, 0.0F) : rounded;
  }

  /// Whether a contact is one of a point that has already passed the surface.
  static bool is_past(const Answer& answer) noexcept {
    return answer.inside || answer.signed_distance_m <= 0;
  }

  static double time_to_sphere(const BoundingSphere& sphere, const SweepPath::State& state) noexcept {
    const Vec3d from_centre_m = state.p_m - sphere.centre_m;
    const double distance_m = norm(from_centre_m), h_m = distance_m - sphere.radius_m;
    if (!(h_m > 0)) return 0;
    return time_to_plane(h_m, dot(from_centre_m, state.velocity_m) / distance_m, state.acceleration_m);
  }

  /// How far a point outside of a bent superquadric surely is from it. `straight_m`: where in the straight
  /// frame, with that beta; h_m: from the plane there that has all of it on its other side.
  ///
  /// A way of length d in the object is at most d / (L - k d) long in the straight frame, L = min(lambda, 1):
  /// lambda changes by k a metre. So d = h L / (1 + k h) does not reach it; nor, with h <= 2/k, round the far
  /// side of the arc. Nor does a way that is too short for lambda to become 1 - bend_reach().
  static double clearance_m(const Superquadric& shape, const Vec3d& straight_m, double above_m) noexcept {
    const double k = shape.bend.curvature(), least_stretch = 1 - bend_reach(shape);
    // Beyond kMostBendTangent, 2.21 rad, places are not told apart; no superquadric turns beyond 2.
    if (k * std::abs(straight_m.z) > 2.2) return least_stretch * std::sin(0.2) / k;
    const double stretch = shape.bend.stretch(straight_m), h_m = std::min(above_m, 2 / k);
    return std::max(h_m * std::min(stretch, 1.0) / (1 + k * h_m), (least_stretch - stretch) / k);
  }
  Relation relate_bent(const Sweeper::Body& body, const SweepPath::State& state,
                       Relation relation) const noexcept {
    const Superquadric unbent = straight(body.shape);
    const Vec3d straight_m = straightened(body.shape.bend, relation.p_part_m);
    const double above_m = (1 - 1 / relation.beta) * dot(normal_at(unbent, straight_m), straight_m);
    const double free_m = relation.beta > 1 + body.skin ? clearance_m(body.shape, straight_m, above_m) : 0;
    relation.side = free_m > tolerance_m_ / 16 ? Side::kOutside : Side::kSkin;
    relation.free_time = time_in_ball(free_m, state);
    return relation;
  }

  Relation relate(const Sweeper::Body& body, const SweepPath::State& state) const noexcept {
    Relation relation{Side::kWithin, 0, 0, {}};
    relation.p_part_m = body.object_from_part.apply_inverse(state.p_m - body.translation_m);
    relation.beta = inside_outside_radial(body.shape, relation.p_part_m);
    if (relation.beta < 1 - body.skin) return relation;
    if (!body.shape.bend.is_none()) return relate_bent(body, state, relation);
    const Vec3d normal = normal_at(body.shape, relation.p_part_m);
    // beta is homogeneous: grad beta . p = beta gives |grad beta|.
    const double h_m = (1 - 1 / relation.beta) * dot(normal, relation.p_part_m);
    const double along_m = dot(body.object_from_part.apply(normal), state.velocity_m);
    if (relation.beta > 1 + body.skin) {
      relation.side = Side::kOutside;
      relation.free_time = time_to_plane(h_m, along_m, state.acceleration_m);
      return relation;
    }
    relation.side = Side::kSkin;
    // Leaving: the plane through the point itself is not met again before this.
    if (along_m >= 0) {
      const double back = state.acceleration_m > 0 ? 2 * along_m / state.acceleration_m
                                                   : std::numeric_limits<double>::infinity();
      if (back >= time_in_ball(tolerance_m_ / 2, state)) {
        relation.side = Side::kOutside;
        relation.free_time = back;
      }
    }
    return relation;
  }

  /// Float may hold a point of the skin for outside: a place beside it that is surely inside; object frame.
  static Vec3d just_inside(const Sweeper::Body& body, const Relation& relation) noexcept {
    const Superquadric unbent = straight(body.shape);
    const Vec3d p_m = straightened(body.shape.bend, relation.p_part_m), normal = normal_at(unbent, p_m);
    // Straight down is nearest; at a sharp edge it need not lead inside, towards the centre does.
    const double above = body.shape.bend.is_none() ? 0 : std::max(1 - 1 / relation.beta, 0.0);
    const double down = 3 * body.skin + 2 * above;
    Vec3d inner_m = p_m - (down * dot(normal, p_m)) * normal;
    if (!(inside_outside_radial(unbent, inner_m) < 1 - body.skin))
      inner_m = ((1 - 2 * body.skin) / relation.beta) * p_m;
    return body.object_from_part.apply(bent(body.shape.bend, inner_m)) + body.translation_m;
  }

  Look look_at(const SweepPath::State& state) const noexcept {
    Look look;
    // Far from the object its sphere alone decides; near it, steps towards the sphere would creep.
    const double centre_m = norm(state.p_m - sweeper_.sphere_.centre_m);
    if (centre_m > 1.01 * sweeper_.sphere_.radius_m) {
      look.free_time = time_to_sphere(sweeper_.sphere_, state);
      return look;
    }
    bool within = false;
    double blind_m = std::numeric_limits<double>::infinity();
    for (const Sweeper::Body& body : sweeper_.bodies_) {
      const double sphere_time = time_to_sphere(body.sphere, state);
      if (sphere_time >= look.free_time) continue;
      const Relation relation = relate(body, state);
      if (relation.side == Side::kOutside) {
        look.free_time = std::min(look.free_time, std::max(relation.free_time, sphere_time));
        continue;
      }
      const Vec3d& a_m = body.shape.semi_axes_m;
      blind_m = std::min(blind_m, kBlindStep * std::min({a_m.x, a_m.y, a_m.z}));
      if (relation.side == Side::kWithin) {
        within = true;
        continue;
      }
      const Vec3d inner_m = just_inside(body, relation);
      ask(inner_m, norm(inner_m - state.p_m), blind_m, state, look);
      if (look.contact) return look;
    }
    if (within) ask(state.p_m, 0, blind_m, state, look);
    return look;
  }

  /// Asks the object about p_m, `aside_m` beside the path; shortens look.free_time to what the answer allows.
  void ask(const Vec3d& p_m, double aside_m, double blind_m, const SweepPath::State& state,
           Look& look) const noexcept {
    const Answer answer = start_.object().query(cast<float>(p_m), query_);
    const double distance_m = answer.signed_distance_m;
    const bool approaches = !(dot(cast<double>(answer.normal), state.velocity_m) > 0);
    if (answer.inside || distance_m <= 0 || (distance_m <= tolerance_m_ && approaches)) {
      look.contact = true;
      look.answer = answer;
      return;
    }
    // NaN: no distance known here. Nearer to a surface than to its error, steps stay shorter than the
    // distance, down to where a point that slides along a wall would not get on.
    const double free_m = std::isnan(distance_m)
                              ? blind_m
                              : std::max({distance_m - aside_m - error_m_,
                                          std::min(distance_m, tolerance_m_) / 2, tolerance_m_ / 16});
    look.free_time = std::min(look.free_time, time_in_ball(free_m, state));
    look.proven = false;
  }

  /// Bisection between a time without contact and one with.
  double first_contact_after(double clear, double touching) const noexcept {
    constexpr int kHalvings = 24;  // the resolution of a float time
    for (int i = 0; i < kHalvings; ++i) {
      const double middle = (clear + touching) / 2;
      (look_at(path_.at(middle)).contact ? touching : clear) = middle;
    }
    return touching;
  }

  static SweepResult clear_path(SweepResult result) noexcept {
    result.status = SweepStatus::kClear;
    result.time = 1;
    return result;
  }

  SweepResult contact_at(double t, const Answer& answer, SweepResult result) const noexcept {
    result.status = SweepStatus::kContact;
    result.time = rounded_down(t);
    result.starts_in_contact = t == 0;
    const Vec3d p_world_m = path_.in_world(t);
    Contact& contact = result.contact;
    contact.part = answer.part;
    contact.normal = cast<float>(path_.to_world_direction(t, cast<double>(answer.normal)));
    contact.position_m = contact.surface_m = cast<float>(p_world_m);
    if (std::isnan(answer.signed_distance_m)) return result;
    const Vec3d to_surface_m = cast<double>(answer.surface_m) - path_.at(t).p_m;
    contact.surface_m = cast<float>(p_world_m + static_cast<double>(start_.scale()) *
                                                    path_.to_world_direction(t, to_surface_m));
    if (answer.signed_distance_m < 0) contact.depth_m = -answer.signed_distance_m * start_.scale();
    return result;
  }

  const Sweeper& sweeper_;
  const Instance& start_;
  const SweepPath& path_;
  QueryOptions query_;
  double tolerance_m_{}, error_m_{};
  std::uint32_t max_steps_{};
};

SweepResult Sweeper::sweep(const Instance& start, const Instance& end, const PointMotion& motion,
                           const SweepOptions& options) const noexcept {
  const Object& object = start.object();
  const bool belongs = &object == &end.object() && start.scale() == end.scale() &&
                       start.mirrored() == end.mirrored() && object.sphere() == sphere_ &&
                       object.part_count() == bodies_.size();
  const SweepPath path(start, end, motion);
  if (!belongs || !path.is_finite()) return {};
  return SweepRun(*this, start, path, options).run();
}

void Sweeper::sweep(const Instance& start, const Instance& end, std::span<const PointMotion> motions,
                    std::span<SweepResult> results, const SweepOptions& options) const noexcept {
  for (std::size_t i = 0; i < motions.size(); ++i) {
    results[i] = sweep(start, end, motions[i], options);
    results[i].contact.point = static_cast<std::uint32_t>(i);
  }
}

}  // namespace sqmap::runtime

// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "sqmap/bake/bake.hpp"
#include "sqmap/runtime/object.hpp"

#include "support/shapes.hpp"
#include "support/targets.hpp"

// Shapes whose inside everybody knows, judged by formulas of the shapes, not by the mesh or the baker's
// oracle.
namespace sqmap::bake {
namespace {

using std::numbers::pi;

constexpr double kDegree = pi / 180;

/// A point, and what layers 2 and 3 must say of it: the distance, negative in the material, and the direction
/// in which the surface faces where it is nearest.
struct Place {
  Vec3d p_m;
  double depth_m;
  Vec3d normal;
};

/// How close it comes.
struct Closeness {
  double depth = 0.001;            ///< error of the distance / R_max
  double angle_rad = 1 * kDegree;  ///< between the normals
};

/// Of random places in the material within 5 % of R_max of the surface, how many may have no distance, one
/// that is off by 0.5 % of R_max, or a normal that is off by 15 degrees, more than any facets meet at. All
/// are known limits, a third to a half above what is measured. Most are of places between two faces, of which
/// the foot search takes the other; of the cone and torus in layer 2, of normals of the superquadric that
/// miss the surface.
struct Shares {
  double unknown = 0, off = 0, askew = 0;
};

/// What must come of one shape. `depth_m` is below zero in the material, and nowhere farther from zero than
/// the surface is from the point. NaN: the point is not judged.
struct Shape {
  std::string name;
  Mesh mesh;
  std::function<double(const Vec3d&)> depth_m;
  double volume_m3;
  std::size_t least_parts = 1, most_parts = 1;
  double most_union;                       ///< volume of the union of the superquadrics / volume_m3
  double most_wrong;                       ///< depth of a point that is told the wrong side / R_max
  double volume_off = 0.015;               ///< of the points told inside, as a share of those that are
  std::vector<Vec3d> inside_m, outside_m;  ///< points to ask about
  std::vector<Place> places;
  Closeness layer_2{}, layer_3{};
  Shares shares_2{}, shares_3{};
  bool taper = false;  ///< FitOptions::taper
};

double box_depth_m(const Vec3d& p, const Vec3d& half_m, const Vec3d& centre_m = {}) {
  const Vec3d d = p - centre_m;
  return std::max({std::abs(d.x) - half_m.x, std::abs(d.y) - half_m.y, std::abs(d.z) - half_m.z});
}

constexpr double kCoil_m = 1, kWire_m = 0.2, kPitch_m = 0.8, kTurns = 2;

Vec3d helix_m(double turn_rad) {
  return {kCoil_m * std::cos(turn_rad), kCoil_m * std::sin(turn_rad), kPitch_m * turn_rad / (2 * pi)};
}

/// Distance to the wire round the helix. Near its flat ends the point is not judged.
double spring_depth_m(const Vec3d& p) {
  constexpr int kSteps = 720;
  double least_m = 1e9;
  for (int i = 0; i <= kSteps; ++i)
    least_m = std::min(least_m, norm(p - helix_m(2 * pi * kTurns * i / kSteps)));
  for (const double end_rad : {0.0, 2 * pi * kTurns})
    if (norm(p - helix_m(end_rad)) < 2 * kWire_m) return std::nan("");
  return least_m - kWire_m;
}

/// Below the slanted side of the cone of radius 0.5 and height 1, at this height of the side.
Place on_cone(double z_m, double turn_rad, double below_m) {
  const Vec3d n = normalized(Vec3d{std::cos(turn_rad), std::sin(turn_rad), 0.5});
  const double r_m = 0.5 * (1 - z_m);
  return {Vec3d{r_m * std::cos(turn_rad), r_m * std::sin(turn_rad), z_m} - below_m * n, -below_m, n};
}

/// Beside the wire's middle line, away from the coil's axis, or towards it.
Place on_spring(double turn_rad, double out_m) {
  const Vec3d out{std::cos(turn_rad), std::sin(turn_rad), 0};
  return {helix_m(turn_rad) + out_m * out, std::abs(out_m) - kWire_m, out_m > 0 ? out : -out};
}

std::vector<Shape> make_shapes() {
  std::vector<Shape> shapes;
  shapes.push_back({.name = "cube",
                    .mesh = test::box({0.5, 0.5, 0.5}),
                    .depth_m =
                        [](const Vec3d& p) {
                          return box_depth_m(p, {0.5, 0.5, 0.5});
                        },
                    .volume_m3 = 1,
                    .most_union = 1.22,
                    .most_wrong = 0.0025,
                    .inside_m = {{}, {0.49, 0, 0}, {0.49, 0.49, 0.49}, {-0.49, 0.49, -0.49}},
                    .outside_m = {{0.51, 0, 0}, {0.51, 0.51, 0.51}, {0, -0.52, 0.4}},
                    .places = {{{0.45, 0, 0}, -0.05, {1, 0, 0}},
                               {{0, -0.48, 0.1}, -0.02, {0, -1, 0}},
                               {{0.2, 0.1, 0.47}, -0.03, {0, 0, 1}},
                               {{-0.3, 0.44, -0.3}, -0.06, {0, 1, 0}}},
                    .shares_2 = {0, 0.004, 0.015},
                    .shares_3 = {0, 0.001, 0.01}});
  shapes.push_back({.name = "sphere",
                    .mesh = test::sphere(1, 4),
                    .depth_m = [](const Vec3d& p) { return norm(p) - 1; },
                    .volume_m3 = 4 * pi / 3,
                    .most_union = 1.02,
                    .most_wrong = 0.001,
                    .inside_m = {{}, {0.98, 0, 0}, {0, 0, -0.98}, {0.56, 0.56, 0.56}},
                    .outside_m = {{1.02, 0, 0}, {0, 0, -1.02}, {0.6, 0.6, 0.6}},
                    .places = {{{0.9, 0, 0}, -0.1, {1, 0, 0}},
                               {{0, 0, -0.95}, -0.05, {0, 0, -1}},
                               {{0.54, 0.54, 0.54}, 0.54 * std::sqrt(3) - 1, {1, 1, 1}},
                               {{-0.6, 0.7, 0}, std::hypot(0.6, 0.7) - 1, {-0.6, 0.7, 0}}}});
  shapes.push_back(
      {.name = "cylinder",
       .mesh = test::cylinder(0.5, 1, 96),
       .depth_m = [](const Vec3d& p) { return std::max(std::hypot(p.x, p.y) - 0.5, std::abs(p.z) - 1); },
       .volume_m3 = pi / 2,
       .most_union = 1.18,
       .most_wrong = 0.004,
       .inside_m = {{}, {0.47, 0, 0.97}, {0, 0, -0.98}, {0.34, 0.34, 0}},
       .outside_m = {{0.53, 0, 0}, {0, 0, 1.03}, {0.37, 0.37, 0.5}},
       .places = {{{0.45, 0, 0}, -0.05, {1, 0, 0}},
                  {{0, -0.4, 0.5}, -0.1, {0, -1, 0}},
                  {{0.1, 0, 0.95}, -0.05, {0, 0, 1}},
                  {{0, 0.2, -0.9}, -0.1, {0, 0, -1}}},
       .shares_2 = {0, 0.05, 0.07},
       .shares_3 = {0, 0.008, 0.02}});
  shapes.push_back(
      {.name = "cone",
       .mesh = test::cone(0.5, 1, 96),
       .depth_m =
           [](const Vec3d& p) {
             return std::max(-p.z, (std::hypot(p.x, p.y) - 0.5 * (1 - p.z)) / std::hypot(1.0, 0.5));
           },
       .volume_m3 = pi / 12,
       .most_parts = 4,
       .most_union = 2.3,  // measured 2.1: it tapers, a superquadric does not; one would have 3 at least
       .most_wrong = 0.005,
       .inside_m = {{0, 0, 0.03}, {0.4, 0, 0.05}, {0, 0, 0.9}, {0, 0.2, 0.5}},
       .outside_m = {{0, 0, -0.03}, {0, 0, 1.03}, {0.3, 0, 0.5}, {0.5, 0, 0.1}},
       .places = {on_cone(0.5, 0, 0.05),
                  on_cone(0.4, 2, 0.05),
                  on_cone(0.7, -1, 0.02),
                  {{0.1, 0, 0.05}, -0.05, {0, 0, -1}}},
       // measured in layer 2: 0.0077 R_max, and 41 degrees at one of them; 2.3 degrees in layer 3
       .layer_2 = {0.01, 45 * kDegree},
       .layer_3 = {0.0015, 5 * kDegree},
       .shares_2 = {0.004, 0.3, 0.06},
       .shares_3 = {0.004, 0.01, 0.012}});
  Shape tapered = shapes.back();
  tapered.name = "cone_by_tapers";
  tapered.taper = true;
  tapered.most_union = 1.2;
  tapered.layer_2 = tapered.layer_3;
  tapered.shares_2 = {0.004, 0.08, 0.06};
  tapered.shares_3.askew = 0.019;
  shapes.push_back(tapered);
  shapes.push_back(
      {.name = "l_shape",
       .mesh = test::l_shape(2, 0.5),
       .depth_m =
           [](const Vec3d& p) {
             return std::min(box_depth_m(p, {1, 0.25, 0.25}, {1, 0.25, 0}),
                             box_depth_m(p, {0.25, 1, 0.25}, {0.25, 1, 0}));
           },
       .volume_m3 = 0.875,
       .least_parts = 2,
       .most_parts = 4,
       .most_union = 1.2,
       .most_wrong = 0.003,
       .inside_m = {{0.1, 0.1, 0}, {1.95, 0.25, 0}, {0.25, 1.95, 0}, {0.45, 0.45, 0.2}, {1, 0.47, 0}},
       .outside_m = {{0.55, 0.55, 0}, {1, 0.55, 0}, {2.05, 0.25, 0}, {0.25, 1, 0.3}},
       .places = {{{1.5, 0.05, 0}, -0.05, {0, -1, 0}},
                  {{1.5, 0.25, 0.2}, -0.05, {0, 0, 1}},
                  {{0.05, 1.2, 0}, -0.05, {-1, 0, 0}},
                  {{1.2, 0.46, 0}, -0.04, {0, 1, 0}},
                  {{0.46, 1.3, 0}, -0.04, {1, 0, 0}}},
       .shares_2 = {0.004, 0.03, 0.045},
       .shares_3 = {0.004, 0.007, 0.025}});
  shapes.push_back(
      {.name = "torus",
       .mesh = test::torus(1, 0.3, 64, 32),
       .depth_m = [](const Vec3d& p) { return std::hypot(std::hypot(p.x, p.y) - 1, p.z) - 0.3; },
       .volume_m3 = 2 * pi * pi * 0.09,
       .least_parts = 2,
       .most_parts = 8,
       .most_union = 1.75,
       .most_wrong = 0.004,
       .inside_m = {{1, 0, 0}, {-1, 0, 0.27}, {0, 0.73, 0}, {0, -1.27, 0}, {0.707, 0.707, -0.27}},
       .outside_m = {{}, {0, 0, 0.1}, {0.66, 0, 0}, {0, 1.34, 0}, {-1, 0, 0.34}},
       .places = {{{1.25, 0, 0}, -0.05, {1, 0, 0}},
                  {{0, 0.75, 0}, -0.05, {0, -1, 0}},
                  {{std::sqrt(0.5), std::sqrt(0.5), -0.2}, -0.1, {0, 0, -1}},
                  {{-1, 0, 0.25}, -0.05, {0, 0, 1}}},
       // measured: 0.0127 R_max and 17 degrees in layer 2, 0.0054 R_max and 5.6 degrees in layer 3
       .layer_2 = {0.015, 20 * kDegree},
       .layer_3 = {0.01, 10 * kDegree},
       .shares_2 = {0.002, 0.14, 0.09},
       .shares_3 = {0.002, 0.005, 0.008}});
  shapes.push_back(
      {.name = "spring",
       .mesh = test::spring(kCoil_m, kWire_m, kPitch_m, kTurns, 40, 32),
       .depth_m = spring_depth_m,
       .volume_m3 = pi * kWire_m * kWire_m * kTurns * std::hypot(2 * pi * kCoil_m, kPitch_m),
       .least_parts = 8,
       .most_parts = 16,
       .most_union = 1.85,
       .most_wrong = 0.003,
       .inside_m = {helix_m(pi / 2), helix_m(pi), helix_m(2 * pi), helix_m(3 * pi), helix_m(3.4 * pi)},
       .outside_m =
           {{0, 0, 0.8}, {1, 0, 0.4}, helix_m(pi) + Vec3d{0, 0, 0.4}, helix_m(2 * pi) + Vec3d{0.25, 0, 0}},
       .places = {on_spring(0.9 * pi, 0.15), on_spring(1.5 * pi, -0.15), on_spring(2.2 * pi, 0.17),
                  on_spring(3 * pi, -0.16)},
       // measured: 0.020 R_max and 31 degrees in layer 2, 10 degrees in layer 3; facets meet at 11
       .layer_2 = {0.03, 45 * kDegree},
       .layer_3 = {0.0015, 15 * kDegree},
       .shares_2 = {0.002, 0.16, 0.22},
       .shares_3 = {0, 0.002, 0.008}});
  shapes.push_back({.name = "thin_sheet",
                    .mesh = test::thin_sheet(1, 0.02),
                    .depth_m =
                        [](const Vec3d& p) {
                          return box_depth_m(p, {0.5, 0.5, 0.01});
                        },
                    .volume_m3 = 0.02,
                    .most_parts = 3,  // one box would err by 3.5 times the target
                    .most_union = 1.45,
                    .most_wrong = 0.035,  // its rim is as high as a texel
                    .volume_off = 0.025,
                    .inside_m = {{}, {0.45, 0.45, 0}, {-0.3, 0.1, 0.004}, {0.2, -0.4, -0.004}},
                    .outside_m = {{0, 0, 0.02}, {0, 0.3, -0.02}, {0.55, 0, 0}},
                    .places = {{{0, 0, 0.005}, -0.005, {0, 0, 1}},
                               {{0.2, -0.3, -0.008}, -0.002, {0, 0, -1}},
                               {{-0.3, 0.1, 0.004}, -0.006, {0, 0, 1}}},
                    .shares_2 = {0.003, 0.045, 0.03},
                    .shares_3 = {0.003, 0.02, 0.03}});
  shapes.push_back(
      {.name = "hollow_box",
       .mesh = test::hollow_box({1, 1, 1}, 0.25),
       .depth_m =
           [](const Vec3d& p) {
             return std::max(box_depth_m(p, {1, 1, 1}), -box_depth_m(p, {0.75, 0.75, 0.75}));
           },
       .volume_m3 = 8 - 3.375,
       .most_parts = 8,
       .most_union = 2.12,  // 8 / 4.625 for the hull alone
       .most_wrong = 0.008,
       .inside_m = {{0.87, 0, 0}, {0, -0.87, 0.3}, {0, 0, 0.87}, {0.9, 0.9, 0.9}, {-0.87, 0.7, -0.7}},
       .outside_m = {{}, {0.6, 0, 0}, {0.6, -0.6, 0.6}, {0, 0, -0.7}, {1.1, 0, 0}},
       .places = {{{0.95, 0, 0}, -0.05, {1, 0, 0}},
                  {{0.8, 0.1, -0.2}, -0.05, {-1, 0, 0}},
                  {{0, -0.97, 0.3}, -0.03, {0, -1, 0}},
                  {{0.7, 0, 0}, 0.05, {-1, 0, 0}},
                  {{0, 0.1, 0.72}, 0.03, {0, 0, -1}}},
       .shares_2 = {0, 0.03, 0.04},
       .shares_3 = {0, 0.03, 0.04}});
  shapes.push_back(
      {.name = "nested_shells",
       .mesh = test::joined({test::sphere(1, 4), test::flipped(test::sphere(0.7, 4)), test::sphere(0.4, 4)}),
       .depth_m =
           [](const Vec3d& p) { return std::min(std::max(norm(p) - 1, 0.7 - norm(p)), norm(p) - 0.4); },
       .volume_m3 = 4 * pi / 3 * (1 - 0.343 + 0.064),
       .least_parts = 3,
       .most_parts = 3,
       .most_union = 1.45,
       .most_wrong = 0.001,
       .inside_m = {{}, {0.3, 0.1, 0}, {0, 0.85, 0}, {0, 0, -0.95}, {0.5, 0.5, 0.5}},
       .outside_m = {{0.55, 0, 0}, {0, -0.6, 0}, {0.3, 0.3, 0.35}, {1.05, 0, 0}},
       .places = {{{0.95, 0, 0}, -0.05, {1, 0, 0}},
                  {{0, 0.75, 0}, -0.05, {0, -1, 0}},
                  {{0, 0, -0.36}, -0.04, {0, 0, -1}},
                  {{0.65, 0, 0}, 0.05, {-1, 0, 0}},
                  {{0, 0.45, 0}, 0.05, {0, 1, 0}}}});
  shapes.push_back(
      {.name = "touching_boxes",
       .mesh =
           test::joined({test::box({0.5, 0.5, 0.5}, {-0.5, 0, 0}), test::box({0.5, 0.5, 0.5}, {0.5, 0, 0})}),
       .depth_m =
           [](const Vec3d& p) {
             return box_depth_m(p, {1, 0.5, 0.5});
           },
       .volume_m3 = 2,
       .most_parts = 1,
       .most_union = 1.2,
       .most_wrong = 0.003,
       .inside_m = {{-0.02, 0, 0}, {0.02, 0.3, -0.3}, {0.97, 0.4, 0.4}, {-0.97, 0, -0.4}, {0.5, 0, 0}},
       .outside_m = {{1.03, 0, 0}, {-1.03, 0, 0}, {0, 0.53, 0}, {0, 0, -0.53}},
       .places = {{{0.95, 0, 0}, -0.05, {1, 0, 0}},
                  {{-0.5, 0.45, 0}, -0.05, {0, 1, 0}},
                  {{0.5, 0.1, -0.46}, -0.04, {0, 0, -1}},
                  {{-0.96, 0.2, 0.1}, -0.04, {-1, 0, 0}}},
       .shares_2 = {0, 0.015, 0.03},
       .shares_3 = {0, 0.001, 0.01}});
  return shapes;
}

const std::vector<Shape>& all_shapes() {
  static const std::vector<Shape> shapes = make_shapes();
  return shapes;
}

/// Barr's function, as he wrote it, of the point with its taper undone.
bool holds(const Part& part, const Vec3d& p_m) {
  const Vec3d local_m =
      rotation(part.object_from_part.orientation).apply_inverse(p_m - part.object_from_part.translation_m);
  const Vec3d& semi_axes_m = part.shape.semi_axes_m;
  const double e1 = part.shape.e1, e2 = part.shape.e2;
  const double width = 1 + part.shape.taper * local_m.z / semi_axes_m.z;
  const double x = std::abs(local_m.x / semi_axes_m.x) / width;
  const double y = std::abs(local_m.y / semi_axes_m.y) / width;
  const double z = std::abs(local_m.z / semi_axes_m.z);
  if (z > 1) return false;
  return std::pow(std::pow(x, 2 / e2) + std::pow(y, 2 / e2), e2 / e1) + std::pow(z, 2 / e1) <= 1;
}

bool any_holds(const Asset& asset, const Vec3d& p_m) {
  return std::ranges::any_of(asset.parts, [&](const Part& part) { return holds(part, p_m); });
}

void expect_places(const Shape& shape, const Asset& asset, const runtime::Object& object) {
  for (const runtime::Layer layer : {runtime::Layer::kTwo, runtime::Layer::kThree}) {
    const Closeness& limit = layer == runtime::Layer::kTwo ? shape.layer_2 : shape.layer_3;
    double worst_m = 0, worst_rad = 0;
    int known = 0;
    for (const Place& place : shape.places) {
      SCOPED_TRACE("layer " + std::to_string(static_cast<int>(layer)) + " at " + std::to_string(place.p_m.x) +
                   " " + std::to_string(place.p_m.y) + " " + std::to_string(place.p_m.z));
      const runtime::Answer answer = object.query(cast<float>(place.p_m), {layer});
      EXPECT_EQ(answer.inside, place.depth_m < 0);
      if (std::isnan(answer.signed_distance_m)) {
        ADD_FAILURE() << "knows no distance";
        continue;
      }
      EXPECT_NEAR(answer.signed_distance_m, place.depth_m, limit.depth * asset.r_max_m);
      const double cosine = dot(cast<double>(answer.normal), normalized(place.normal));
      const double angle_rad = std::acos(std::clamp(cosine, -1.0, 1.0));
      EXPECT_LE(angle_rad, limit.angle_rad);
      worst_m = std::max(worst_m, std::abs(answer.signed_distance_m - place.depth_m));
      worst_rad = std::max(worst_rad, angle_rad);
      ++known;
    }
    const std::string name = "layer_" + std::to_string(static_cast<int>(layer));
    testing::Test::RecordProperty(name, std::to_string(known) + " known, off " +
                                            std::to_string(worst_m / asset.r_max_m) + " R_max, " +
                                            std::to_string(worst_rad / kDegree) + " degrees");
  }
}

/// The nearest point of the surface, where the shape's formula tells it: depth_m is nowhere farther from zero
/// than the surface, so that a point of the surface as far away is the nearest. Otherwise NaN.
Place nearest_of(const Shape& shape, const Vec3d& p_m, double r_max_m) {
  const double depth_m = shape.depth_m(p_m), step_m = 1e-5 * r_max_m;
  Vec3d normal;
  for (int axis = 0; axis < 3; ++axis) {
    Vec3d step;
    step[axis] = step_m;
    normal[axis] = (shape.depth_m(p_m + step) - shape.depth_m(p_m - step)) / (2 * step_m);
  }
  // The spring's middle line is a polygon: its formula errs by 2e-4 m.
  const bool is_nearest =
      std::abs(norm(normal) - 1) < 0.02 && std::abs(shape.depth_m(p_m - depth_m * normal)) < 2e-4 * r_max_m;
  return {p_m, is_nearest ? depth_m : std::nan(""), normal};
}

void expect_shares(const Shape& shape, const runtime::Object& object, const std::vector<Vec3f>& points,
                   double r_max_m) {
  std::vector<Place> places;
  for (std::size_t i = 0; i < points.size() && places.size() < 2000; ++i) {
    const double depth_m = shape.depth_m(cast<double>(points[i]));
    if (!(depth_m < 0 && depth_m > -0.05 * r_max_m)) continue;
    const Place place = nearest_of(shape, cast<double>(points[i]), r_max_m);
    if (std::isfinite(place.depth_m)) places.push_back(place);
  }
  EXPECT_GE(places.size(), 500U);
  for (const runtime::Layer layer : {runtime::Layer::kTwo, runtime::Layer::kThree}) {
    const Shares& limit = layer == runtime::Layer::kTwo ? shape.shares_2 : shape.shares_3;
    int unknown = 0, off = 0, askew = 0;
    for (const Place& place : places) {
      const runtime::Answer answer = object.query(cast<float>(place.p_m), {layer});
      unknown += !std::isfinite(answer.signed_distance_m);
      off += std::abs(answer.signed_distance_m - place.depth_m) > 0.005 * r_max_m;
      askew += std::isfinite(answer.signed_distance_m) &&
               dot(cast<double>(answer.normal), place.normal) < std::cos(15 * kDegree);
    }
    const double all = static_cast<double>(places.size());
    SCOPED_TRACE("layer " + std::to_string(static_cast<int>(layer)));
    EXPECT_LE(unknown, limit.unknown * all);
    EXPECT_LE(off, limit.off * all);
    EXPECT_LE(askew, limit.askew * all);
    testing::Test::RecordProperty("shares_" + std::to_string(static_cast<int>(layer)),
                                  std::to_string(places.size()) + " places: " + std::to_string(unknown) +
                                      " unknown, " + std::to_string(off) + " off, " + std::to_string(askew) +
                                      " askew");
  }
}

class SimpleShape : public testing::TestWithParam<int> {};

TEST_P(SimpleShape, StaysExact) {
  const Shape& shape = all_shapes()[static_cast<std::size_t>(GetParam())];
  BakeOptions options;
  options.sample_count = 2000;
  options.fit.taper = shape.taper;
  const auto baked = bake(test::as_source(shape.mesh), options);
  ASSERT_TRUE(baked.ok()) << baked.error().finding;
  const Asset& asset = baked.value().asset;
  const auto object = runtime::Object::build(asset);
  ASSERT_TRUE(object.ok()) << object.error().finding;

  expect_places(shape, asset, object.value());
  EXPECT_GE(asset.parts.size(), shape.least_parts);
  EXPECT_LE(asset.parts.size(), shape.most_parts);
  EXPECT_NEAR(asset.mesh.volume_m3, shape.volume_m3, 0.015 * shape.volume_m3);
  for (const Vec3d& p_m : shape.mesh.vertices_m) ASSERT_TRUE(any_holds(asset, p_m));
  for (const Vec3d& p_m : shape.inside_m)
    EXPECT_TRUE(object.value().query(cast<float>(p_m)).inside) << p_m.x << " " << p_m.y << " " << p_m.z;
  for (const Vec3d& p_m : shape.outside_m)
    EXPECT_FALSE(object.value().query(cast<float>(p_m)).inside) << p_m.x << " " << p_m.y << " " << p_m.z;

  std::mt19937_64 random(11);
  std::uniform_real_distribution<double> unit(-1, 1);
  const auto random_point_m = [&](const Vec3d& half_m) {
    return Vec3d{half_m.x * unit(random), half_m.y * unit(random), half_m.z * unit(random)};
  };
  constexpr int kPoints = 20000;
  const double reach_m = asset.sphere.radius_m;
  int in_union = 0;
  for (int i = 0; i < kPoints; ++i)
    in_union += any_holds(asset, asset.sphere.centre_m + random_point_m({reach_m, reach_m, reach_m}));
  const double union_share = 8 * reach_m * reach_m * reach_m * in_union / kPoints / shape.volume_m3;
  EXPECT_LE(union_share, shape.most_union);
  RecordProperty("parts", static_cast<int>(asset.parts.size()));
  RecordProperty("union_over_volume", std::to_string(union_share));

  Vec3d low_m = shape.mesh.vertices_m[0], high_m = low_m;
  for (const Vec3d& p_m : shape.mesh.vertices_m)
    for (int axis = 0; axis < 3; ++axis) {
      low_m[axis] = std::min(low_m[axis], p_m[axis]);
      high_m[axis] = std::max(high_m[axis], p_m[axis]);
    }
  int told = 0, truly = 0;
  double worst_m = 0;
  std::vector<Vec3f> points;
  for (int i = 0; i < kPoints; ++i)
    points.push_back(cast<float>(0.5 * (low_m + high_m) + random_point_m(0.55 * (high_m - low_m))));
  for (const Vec3f& p : points) {
    const double depth_m = shape.depth_m(cast<double>(p));
    if (std::isnan(depth_m)) continue;
    const bool is_inside = object.value().query(p).inside;
    ASSERT_TRUE(!is_inside || object.value().query(p, {runtime::Layer::kOne}).inside) << "layer 1 bounds";
    told += is_inside;
    truly += depth_m < 0;
    if (is_inside != (depth_m < 0)) worst_m = std::max(worst_m, std::abs(depth_m));
  }
  EXPECT_GE(truly, 100);
  EXPECT_NEAR(told, truly, shape.volume_off * truly);
  EXPECT_LE(worst_m, shape.most_wrong * asset.r_max_m);
  RecordProperty("told_over_true", std::to_string(static_cast<double>(told) / truly));
  RecordProperty("wrong_side_at_over_r_max", std::to_string(worst_m / asset.r_max_m));
  expect_shares(shape, object.value(), points, asset.r_max_m);
  for (const runtime::Layer layer : {runtime::Layer::kOne, runtime::Layer::kTwo, runtime::Layer::kThree})
    EXPECT_TRUE(test::every_target_agrees(object.value(), points, {layer}));
}

INSTANTIATE_TEST_SUITE_P(Bake, SimpleShape, testing::Range(0, static_cast<int>(all_shapes().size())),
                         [](const auto& shape) {
                           return all_shapes()[static_cast<std::size_t>(shape.param)].name;
                         });

}  // namespace
}  // namespace sqmap::bake

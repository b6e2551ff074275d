// SPDX-License-Identifier: GPL-3.0-or-later
#include "sqmap/bake/decompose.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <map>
#include <numbers>
#include <random>
#include <set>
#include <string>

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "components.hpp"
#include "curvature.hpp"
#include "cuts.hpp"
#include "geodesics.hpp"
#include "min_cut.hpp"
#include "support/shapes.hpp"
#include "surface.hpp"
#include "working_mesh.hpp"

namespace sqmap::bake {
namespace {

using std::numbers::pi;

PreparedMesh prepared(Mesh mesh) {
  Components connected(mesh.vertices_m.size());
  for (const auto& [a, b, c] : mesh.faces) {
    connected.join(a, b);
    connected.join(b, c);
  }
  std::map<std::uint32_t, std::uint32_t> number;
  PreparedMesh result;
  for (const auto& face : mesh.faces)
    result.component.push_back(
        number.try_emplace(connected.find(face[0]), static_cast<std::uint32_t>(number.size())).first->second);
  result.mesh = std::move(mesh);
  return result;
}

Decomposition segments(const Mesh& mesh, const DecomposeOptions& options = {}) {
  Result<Decomposition> result = decompose(prepared(mesh), options, {});
  if (!result) ADD_FAILURE() << result.error().finding;
  return result ? std::move(result).value() : Decomposition{};
}

std::size_t segment_count(const Mesh& mesh, const DecomposeOptions& options = {}) {
  return segments(mesh, options).reasons.size();
}

Triangles triangles(const Mesh& mesh) { return {mesh.vertices_m, mesh.faces}; }

Vec3d centroid(const Mesh& mesh, std::size_t face) {
  const auto& [a, b, c] = mesh.faces[face];
  return (1.0 / 3) * (mesh.vertices_m[a] + mesh.vertices_m[b] + mesh.vertices_m[c]);
}

double area(const Mesh& mesh, std::size_t face) {
  const auto& [a, b, c] = mesh.faces[face];
  return 0.5 * norm(cross(mesh.vertices_m[b] - mesh.vertices_m[a], mesh.vertices_m[c] - mesh.vertices_m[a]));
}

// Share of face pairs that one labelling joins and the other separates, faces weighted by area.
double rand_error(const Mesh& mesh, const std::vector<std::uint32_t>& a,
                  const std::vector<std::uint32_t>& b) {
  std::map<std::uint32_t, double> in_a, in_b;
  std::map<std::pair<std::uint32_t, std::uint32_t>, double> in_both;
  double total = 0;
  for (std::size_t f = 0; f < a.size(); ++f) {
    const double weight = area(mesh, f);
    in_a[a[f]] += weight;
    in_b[b[f]] += weight;
    in_both[{a[f], b[f]}] += weight;
    total += weight;
  }
  const auto pairs = [](const auto& sums) {
    double result = 0;
    for (const auto& [key, sum] : sums) result += sum * sum;
    return result;
  };
  return (pairs(in_a) + pairs(in_b) - 2 * pairs(in_both)) / (total * total);
}

// Two balls joined by a thin straight neck along z.
Mesh dumbbell(double ball_m = 1, double neck_radius_m = 0.3, double neck_half_m = 0.6) {
  const double meet_rad = std::acos(neck_radius_m / ball_m);
  const double centre_m = neck_half_m + ball_m * std::sin(meet_rad);
  std::vector<std::pair<double, double>> profile_m;
  test::append_arc(profile_m, ball_m, -centre_m, -pi / 2, meet_rad, 24);
  for (int i = 1; i < 8; ++i) profile_m.emplace_back(neck_radius_m, neck_half_m * (i / 4.0 - 1));
  test::append_arc(profile_m, ball_m, centre_m, -meet_rad, pi / 2, 24);
  return test::revolved(profile_m, 48);
}

// Tube round a trefoil knot.
Mesh knot(double tube_m, std::uint32_t rings, std::uint32_t sides) {
  Mesh mesh = test::torus(2, 1, rings, sides);  // the connectivity; the points follow
  const auto at = [](double t) {
    return Vec3d{std::sin(t) + 2 * std::sin(2 * t), std::cos(t) - 2 * std::cos(2 * t), -std::sin(3 * t)};
  };
  for (std::uint32_t i = 0; i < rings; ++i) {
    const double t = 2 * pi * i / rings;
    const Vec3d along = normalized(at(t + 1e-4) - at(t - 1e-4));
    const Vec3d bent = at(t + 1e-2) + at(t - 1e-2) - 2.0 * at(t);
    const Vec3d out = normalized(bent - dot(bent, along) * along), up = cross(along, out);
    for (std::uint32_t j = 0; j < sides; ++j) {
      const double v = 2 * pi * j / sides;
      mesh.vertices_m[i * sides + j] = at(t) + tube_m * (std::cos(v) * out - std::sin(v) * up);
    }
  }
  return test::signed_volume_m3(mesh) < 0 ? test::flipped(mesh) : mesh;
}

bool is_edge_connected(const Mesh& mesh, const std::vector<std::uint32_t>& label, std::size_t segment_total) {
  Components pieces(mesh.faces.size());
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::vector<std::uint32_t>> faces_at;
  for (std::uint32_t f = 0; f < mesh.faces.size(); ++f)
    for (int i = 0; i < 3; ++i)
      faces_at[std::minmax(mesh.faces[f][i], mesh.faces[f][(i + 1) % 3])].push_back(f);
  for (const auto& [edge, faces] : faces_at)
    for (const std::uint32_t f : faces)
      for (const std::uint32_t g : faces)
        if (label[f] == label[g]) pieces.join(f, g);
  std::set<std::uint32_t> roots;
  for (std::uint32_t f = 0; f < mesh.faces.size(); ++f) roots.insert(pieces.find(f));
  return roots.size() == segment_total;
}

Mesh jittered(Mesh mesh, double amplitude_m, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  const auto draw = [&] {
    return amplitude_m * (2.0 * static_cast<double>(random() >> 11) / 9007199254740992.0 - 1);
  };
  for (Vec3d& p : mesh.vertices_m) p = p + Vec3d{draw(), draw(), draw()};
  return mesh;
}

// A solid for invariance tests with parts of different kinds: a dumbbell whose second ball is flattened.
Mesh uneven_dumbbell() {
  return test::mapped(dumbbell(), [](const Vec3d& p) { return p.z > 0.6 ? Vec3d{p.x, 0.7 * p.y, p.z} : p; });
}

TEST(Decompose, LeavesConvexBodiesWhole) {
  const std::pair<const char*, Mesh> bodies[] = {
      {"sphere", test::sphere(1, 3)},
      {"ellipsoid", test::ellipsoid({1, 0.4, 3}, 4)},
      {"box of twelve faces", test::box({1, 2, 5})},
      {"fine box", test::subdivided(test::subdivided(test::subdivided(test::box({1, 1, 1}))))},
      {"cylinder", test::cylinder(1, 4, 40)},
      {"capsule", test::capsule(1, 5, 40)},
      {"cone", test::cone(1, 3, 40)},
      {"plate", test::thin_sheet(1, 0.01)},
  };
  for (const auto& [name, mesh] : bodies) {
    const Decomposition result = segments(mesh);
    EXPECT_EQ(result.reasons.size(), 1U) << name;
    EXPECT_EQ(result.reasons[0], CutReason::kWhole) << name;
  }
}

TEST(Decompose, CutsADumbbellAtItsNeck) {
  const Mesh mesh = dumbbell();
  const Decomposition result = segments(mesh);
  ASSERT_GE(result.reasons.size(), 2U);
  ASSERT_LE(result.reasons.size(), 3U);
  std::set<std::uint32_t> low, high;  // labels of the balls, away from the neck
  for (std::size_t f = 0; f < mesh.faces.size(); ++f) {
    if (centroid(mesh, f).z < -0.75) low.insert(result.label[f]);
    if (centroid(mesh, f).z > 0.75) high.insert(result.label[f]);
  }
  EXPECT_EQ(low.size(), 1U);
  EXPECT_EQ(high.size(), 1U);
  EXPECT_NE(low, high);
  for (const CutReason reason : result.reasons) EXPECT_EQ(reason, CutReason::kBoundaryStrength);
}

TEST(Decompose, CutsTwoBallsAlongTheirCrease) {
  const Mesh mesh = test::two_spheres(1, 0.8, 48);
  const Decomposition result = segments(mesh);
  ASSERT_EQ(result.reasons.size(), 2U);
  const double edge_m = 0.1;  // a face may lie on either side of the crease it touches
  for (std::size_t f = 0; f < mesh.faces.size(); ++f)
    for (std::size_t g = 0; g < mesh.faces.size(); g += 97)
      if (std::abs(centroid(mesh, f).z) > edge_m && std::abs(centroid(mesh, g).z) > edge_m) {
        ASSERT_EQ(result.label[f] == result.label[g], (centroid(mesh, f).z > 0) == (centroid(mesh, g).z > 0));
      }
}

TEST(Decompose, FindsNothingWithoutItsCriteria) {
  DecomposeOptions off;
  off.use_boundary_strength = off.use_hyperbolic = false;
  EXPECT_EQ(segment_count(dumbbell(), off), 1U);
  EXPECT_EQ(segment_count(test::torus(1, 0.3, 72, 24), off), 1U);
}

TEST(Decompose, CutsBentTubesOnlyByHyperbolicCurvature) {
  const std::pair<const char*, Mesh> tubes[] = {
      {"torus", test::torus(1, 0.3, 72, 24)},
      {"thin torus", test::torus(1, 0.1, 144, 16)},
      {"knot", knot(0.35, 240, 20)},
      {"spring", test::spring(1, 0.2, 0.8, 3, 48, 16)},
  };
  for (const auto& [name, mesh] : tubes) {
    DecomposeOptions without;
    without.use_hyperbolic = false;
    EXPECT_EQ(segment_count(mesh, without), 1U) << name;
    const Decomposition with = segments(mesh);
    EXPECT_GE(with.reasons.size(), 4U) << name;
    EXPECT_LE(with.reasons.size(), 40U) << name;
    for (const CutReason reason : with.reasons) EXPECT_EQ(reason, CutReason::kHyperbolic) << name;
  }
}

TEST(Decompose, PiecesOfATorusTurnByLessThanARightAngle) {
  const Mesh mesh = test::torus(1, 0.2, 120, 20);
  const Decomposition result = segments(mesh);
  std::vector<Vec3d> mean(result.reasons.size());
  for (std::size_t f = 0; f < mesh.faces.size(); ++f)
    mean[result.label[f]] = mean[result.label[f]] + area(mesh, f) * centroid(mesh, f);
  for (std::size_t f = 0; f < mesh.faces.size(); ++f) {
    const Vec3d p = centroid(mesh, f), axis = normalized(mean[result.label[f]]);
    EXPECT_GT(dot(normalized(Vec3d{p.x, p.y, 0}), axis), std::cos(pi / 4)) << "face " << f;
  }
}

TEST(Decompose, KeepsAStraightTubeWhole) { EXPECT_EQ(segment_count(test::capsule(0.2, 6, 32)), 1U); }

TEST(Decompose, SeparatesComponentsAndKeepsSmallOnesWhole) {
  const Mesh mesh = test::joined({test::sphere(1, 3), test::sphere(0.5, 3, {4, 0, 0}),
                                  test::transformed(dumbbell(), {{}, {0, 4, 0}}, 0.02)});
  const Decomposition result = segments(mesh);
  ASSERT_EQ(result.reasons.size(), 3U);  // the tiny dumbbell is not worth a cut
  for (const CutReason reason : result.reasons) EXPECT_EQ(reason, CutReason::kComponent);
  EXPECT_EQ(result.label.front(), 0U);
  EXPECT_EQ(result.label.back(), 2U);
}

TEST(Decompose, NumbersSegmentsByDescendingArea) {
  const Mesh mesh = uneven_dumbbell();
  const Decomposition result = segments(mesh);
  std::vector<double> size(result.reasons.size());
  for (std::size_t f = 0; f < mesh.faces.size(); ++f) size[result.label[f]] += area(mesh, f);
  ASSERT_GE(size.size(), 2U);
  EXPECT_TRUE(std::is_sorted(size.rbegin(), size.rend()));
  EXPECT_GT(size.back(), 0);
}

TEST(Decompose, FollowsRotationScaleAndOrder) {
  const Mesh mesh = uneven_dumbbell();
  const Decomposition expected = segments(mesh);
  const Quaternion turn{0.3, 0.5, -0.2, 0.7};
  for (const double scale : {1e-3, 1.0, 1e3}) {
    const Decomposition moved = segments(test::transformed(mesh, {turn, {1, -2, 3}}, scale));
    EXPECT_EQ(moved.reasons.size(), expected.reasons.size()) << scale;
    EXPECT_LT(rand_error(mesh, expected.label, moved.label), 0.02) << scale;
  }
  Mesh tagged = mesh;  // source_face carries the face's number through the shuffle
  test::number_faces(tagged);
  const Mesh other = test::shuffled(tagged, 7);
  const Decomposition reordered = segments(other);
  std::vector<std::uint32_t> label(mesh.faces.size());
  for (std::size_t f = 0; f < label.size(); ++f) label[other.source_face[f]] = reordered.label[f];
  EXPECT_EQ(reordered.reasons.size(), expected.reasons.size());
  EXPECT_LT(rand_error(mesh, expected.label, label), 0.02);
}

TEST(Decompose, IsStableUnderSubdivisionAndNoise) {
  const Mesh mesh = uneven_dumbbell();
  const Decomposition expected = segments(mesh);
  const Mesh fine = test::subdivided(mesh);
  const Decomposition subdivided = segments(fine);
  std::vector<std::uint32_t> inherited(fine.faces.size());
  for (std::size_t f = 0; f < inherited.size(); ++f) inherited[f] = expected.label[fine.source_face[f]];
  EXPECT_LT(rand_error(fine, inherited, subdivided.label), 0.02);
  const Decomposition noisy = segments(jittered(mesh, 0.01, 3));
  EXPECT_LT(rand_error(mesh, expected.label, noisy.label), 0.02);
}

TEST(Decompose, IsTheSameForAnyNumberOfThreads) {
  const Mesh mesh = test::spring(1, 0.2, 0.8, 2, 48, 16);
  const Decomposition expected = segments(mesh);
  const tbb::global_control one_thread(tbb::global_control::max_allowed_parallelism, 1);
  const Decomposition alone = segments(mesh);
  EXPECT_EQ(alone.label, expected.label);
  EXPECT_EQ(alone.reasons, expected.reasons);
}

TEST(Decompose, EndsOnMeshesThatAreNoSurface) {
  Mesh triangle;
  triangle.vertices_m = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  triangle.faces = {{0, 1, 2}};
  test::number_faces(triangle);
  EXPECT_EQ(segment_count(triangle), 1U);

  Mesh book = triangle;  // three pages on one edge
  book.vertices_m.insert(book.vertices_m.end(), {{0, -1, 0.5}, {0, -1, -0.5}});
  book.faces.insert(book.faces.end(), {{0, 1, 3}, {1, 0, 4}});
  test::number_faces(book);
  EXPECT_EQ(segment_count(book), 1U);

  Mesh flat = triangle;
  flat.vertices_m = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}};
  EXPECT_EQ(segment_count(flat), 1U);

  Mesh needles = test::cylinder(1, 1e5, 64);
  EXPECT_EQ(segment_count(needles), 1U);
  EXPECT_EQ(segment_count(test::open_sheet(1, 12)), 1U);
  EXPECT_TRUE(segments(Mesh{}).reasons.empty());
}

TEST(Decompose, StopsWhenCancelled) {
  Progress progress;
  progress.cancelled = [] { return true; };
  const Result<Decomposition> result = decompose(prepared(test::sphere(1, 2)), {}, progress);
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().status, Status::kCancelled);
}

TEST(Decompose, RefusesOptionsOutsideTheirRange) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_TRUE(DecomposeOptions{}.check());
  const auto refused = [](auto change) {
    DecomposeOptions options;
    change(options);
    const Outcome outcome = options.check();
    return !outcome && outcome.error().status == Status::kBadOption;
  };
  EXPECT_TRUE(refused([](DecomposeOptions& o) { o.source_count = 0; }));
  EXPECT_TRUE(refused([](DecomposeOptions& o) { o.window = 0; }));
  EXPECT_TRUE(refused([](DecomposeOptions& o) { o.locale_width = 1e-9; }));
  EXPECT_TRUE(refused([](DecomposeOptions& o) { o.boundary_strength = -0.1; }));
  EXPECT_TRUE(refused([](DecomposeOptions& o) { o.min_hull_gain = 2; }));
  EXPECT_TRUE(refused([&](DecomposeOptions& o) { o.k_h = nan; }));
  EXPECT_TRUE(refused([&](DecomposeOptions& o) { o.t_h = nan; }));
  EXPECT_TRUE(refused([](DecomposeOptions& o) { o.min_part_area = 0; }));
}

TEST(Decompose, RefusesComponentsThatDoNotMatchTheFaces) {
  PreparedMesh mesh = prepared(test::sphere(1, 1));
  mesh.component.pop_back();
  const Result<Decomposition> result = decompose(mesh, {}, {});
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().status, Status::kInvalidMesh);
}

// The mean geodesic distance between points of a sphere is a quarter of its circumference, from every point.
TEST(Protrusion, OfASphereIsAQuarterTurnEverywhere) {
  const double radius_m = 2, expected = (pi / 2 * radius_m) / std::sqrt(4 * pi * radius_m * radius_m);
  for (const double p : protrusion(prepared(test::sphere(radius_m, 3)), 100))
    EXPECT_NEAR(p, expected, 0.03 * expected);
}

TEST(Protrusion, FromSampledSourcesIsThatFromAll) {
  // Uneven triangles: the sources must be weighted by area, not counted.
  const PreparedMesh mesh = prepared(test::mapped(test::ellipsoid({1, 1, 1}, 3), [](const Vec3d& p) {
    return Vec3d{p.x, 0.6 * p.y, p.z > 0 ? 4 * p.z * p.z : p.z};
  }));
  const std::vector<double> all = protrusion(mesh, 1'000'000), sampled = protrusion(mesh, 100);
  double error = 0, sum = 0;
  for (std::size_t f = 0; f < all.size(); ++f) {
    error += (sampled[f] - all[f]) * (sampled[f] - all[f]);
    sum += all[f] * all[f];
  }
  EXPECT_LT(std::sqrt(error / sum), 0.01);
}

TEST(Protrusion, IsLargestAtTheEndsOfACapsule) {
  const Mesh mesh = test::capsule(0.5, 3, 32);
  const std::vector<double> p = protrusion(prepared(mesh), 60);
  const auto most = static_cast<std::size_t>(std::max_element(p.begin(), p.end()) - p.begin());
  const auto least = static_cast<std::size_t>(std::min_element(p.begin(), p.end()) - p.begin());
  EXPECT_GT(std::abs(centroid(mesh, most).z), 3.3);
  EXPECT_LT(std::abs(centroid(mesh, least).z), 1.6);  // faces of the tube are as long as it
}

TEST(GaussianCurvature, OfASphereIsTheInverseSquaredRadius) {
  for (const double radius_m : {1e-3, 1.0, 50.0})
    for (const double k : gaussian_curvature(prepared(test::sphere(radius_m, 4))))
      EXPECT_NEAR(k * radius_m * radius_m, 1, 0.03);
}

TEST(GaussianCurvature, OfATorusIsNegativeInsideOnly) {
  const double major_m = 1, minor_m = 0.3;
  const Mesh mesh = test::torus(major_m, minor_m, 120, 48);
  const std::vector<double> k = gaussian_curvature(prepared(mesh));
  int inside = 0, outside = 0;
  for (std::size_t f = 0; f < k.size(); ++f) {
    const Vec3d p = centroid(mesh, f);
    const double rho = std::hypot(p.x, p.y);
    const double expected = (rho - major_m) / (minor_m * minor_m * rho);  // cos v / (r (R + r cos v))
    if (rho < major_m - 0.1 * minor_m) {
      EXPECT_LT(k[f], 0);
      ++inside;
    } else if (rho > major_m + 0.1 * minor_m) {
      EXPECT_GT(k[f], 0);
      ++outside;
    }
    EXPECT_NEAR(k[f], expected, 0.5);
  }
  EXPECT_GT(inside, 1000);
  EXPECT_GT(outside, 1000);
}

TEST(GaussianCurvature, DoesNotDependOnTheTessellation) {
  const Mesh mesh = test::sphere(1, 4),
             fine = test::subdivided(mesh);  // same surface, flat faces cut in four
  const std::vector<double> coarse_k = gaussian_curvature(prepared(mesh)),
                            fine_k = gaussian_curvature(prepared(fine));
  double coarse_sum = 0, fine_sum = 0;
  for (std::size_t f = 0; f < mesh.faces.size(); ++f) coarse_sum += coarse_k[f] * area(mesh, f);
  for (std::size_t f = 0; f < fine.faces.size(); ++f) fine_sum += fine_k[f] * area(fine, f);
  EXPECT_NEAR(coarse_sum, 4 * pi, 0.02 * 4 * pi);  // Gauss and Bonnet
  EXPECT_NEAR(fine_sum, 4 * pi, 0.02 * 4 * pi);
}

TEST(BendTensor, IsNeverConcaveOnAConvexBody) {
  const Surface surface = make_surface(triangles(test::subdivided(test::subdivided(test::box({1, 2, 3})))));
  const Curvature bend = curvature(surface, 0.05);
  double most = 0;
  for (const double across : bend_across_links(surface, bend)) {
    EXPECT_GE(across, -1e-9);
    most = std::max(most, across);
  }
  EXPECT_GT(most, 1);  // across the edges of the box it is convex
}

TEST(BendTensor, MeasuresTheWaistOfATorus) {
  const double major_m = 1, minor_m = 0.25;
  const Surface surface = make_surface(triangles(test::torus(major_m, minor_m, 120, 48)));
  const Curvature bend = curvature(surface, 0.01);
  for (std::size_t v = 0; v < surface.points.size(); ++v) {
    const Vec3d p = surface.scale_m * surface.points[v];
    const double rho = std::hypot(p.x, p.y);
    if (rho > major_m - 0.99 * minor_m) continue;
    const Vec3d around_axis{-p.y / rho, p.x / rho, 0};
    EXPECT_NEAR(bend.bend[v].across({0, 0, 1}) / surface.scale_m, -1 / (major_m - minor_m), 0.1);
    EXPECT_NEAR(bend.bend[v].across(around_axis) / surface.scale_m, 1 / minor_m, 0.1);
  }
}

TEST(FastMarching, IsStraightOnAPlane) {
  const Surface surface = make_surface(triangles(test::open_sheet(2, 32)));
  const std::uint32_t corner = 0;
  const std::vector<float> distance = fast_marching(surface, {&corner, 1});
  for (std::size_t v = 0; v < distance.size(); ++v)
    EXPECT_NEAR(distance[v], norm(surface.points[v] - surface.points[corner]), 1e-3);
}

TEST(Geodesics, FollowGreatCircles) {
  const Surface surface = make_surface(triangles(test::sphere(1, 4)));
  const std::uint32_t start = 5;
  const std::vector<float> heat = distances_from_each(surface, {&start, 1})[0];
  const std::vector<float> march = fast_marching(surface, {&start, 1});
  const double radius = norm(surface.points[start]);
  for (std::size_t v = 0; v < surface.points.size(); ++v) {
    const double exact =
        radius *
        std::acos(std::clamp(dot(surface.points[v], surface.points[start]) / (radius * radius), -1.0, 1.0));
    EXPECT_NEAR(heat[v], exact, 0.02);
    EXPECT_NEAR(march[v], exact, 0.02);
  }
}

TEST(Geodesics, CrossEdgesOfThreeFaces) {
  Mesh mesh = test::open_sheet(2, 8);
  const Mesh page = test::mapped(test::open_sheet(2, 8), [](const Vec3d& p) {
    return Vec3d{0, p.y, p.x + 1};
  });
  const auto offset = static_cast<std::uint32_t>(mesh.vertices_m.size());
  const auto weld =
      [&](std::uint32_t v) -> std::uint32_t {  // the page's first column is the sheet's middle one
    return v % 9 == 0 ? v + 4 : offset + v;
  };
  mesh.vertices_m.insert(mesh.vertices_m.end(), page.vertices_m.begin(), page.vertices_m.end());
  for (const auto& [a, b, c] : page.faces) mesh.faces.push_back({weld(a), weld(b), weld(c)});
  std::vector<std::uint32_t> all(mesh.faces.size());
  for (std::uint32_t f = 0; f < all.size(); ++f) all[f] = f;
  const Surface surface = make_surface(extract(mesh.vertices_m, mesh.faces, all));
  const std::uint32_t start = 0;
  const std::vector<float> distance = distances_from_each(surface, {&start, 1})[0];
  for (const float d : distance) EXPECT_TRUE(std::isfinite(d) && d < 3);
}

TEST(FarthestPointSources, ShareTheWholeArea) {
  const Surface surface = make_surface(triangles(test::ellipsoid({1, 2, 3}, 3)));
  const std::vector<Source> sources = farthest_point_sources(surface, 50);
  ASSERT_EQ(sources.size(), 50U);
  double sum = 0;
  for (const Source& source : sources) {
    EXPECT_GT(source.area, 0.2 / 50);
    EXPECT_LT(source.area, 5.0 / 50);
    sum += source.area;
  }
  EXPECT_NEAR(sum, 1, 1e-9);
}

// Against all 2^(n-2) cuts of random graphs.
TEST(MinimumCut, IsTheCheapestOfAllCuts) {
  std::mt19937_64 random(1);
  for (int draw = 0; draw < 200; ++draw) {
    const std::uint32_t count = 4 + random() % 6;
    std::vector<FlowEdge> edges;
    for (std::uint32_t a = 0; a < count; ++a)
      for (std::uint32_t b = a + 1; b < count; ++b)
        if (random() % 2 == 0) edges.push_back({a, b, static_cast<std::int64_t>(random() % 20)});
    const auto cost = [&](const auto& on_source_side) {
      std::int64_t sum = 0;
      for (const FlowEdge& edge : edges)
        if (on_source_side(edge.a) != on_source_side(edge.b)) sum += edge.capacity;
      return sum;
    };
    std::int64_t cheapest = std::numeric_limits<std::int64_t>::max();
    for (std::uint32_t set = 0; set < (1U << count); ++set)
      if ((set & 1U) != 0 && ((set >> 1) & 1U) == 0)
        cheapest = std::min(cheapest, cost([&](std::uint32_t v) { return ((set >> v) & 1U) != 0; }));
    const std::vector<std::uint8_t> side = minimum_cut(count, edges, 0, 1);
    EXPECT_TRUE(side[0] && !side[1]);
    EXPECT_EQ(cost([&](std::uint32_t v) { return side[v] != 0; }), cheapest);
  }
}

TEST(WorkingMesh, HasEvenEdgesAndTheSameTopology) {
  const Mesh inputs[] = {test::sphere(1, 5), test::torus(1, 0.4, 12, 6), test::box({1, 1, 3})};
  for (const Mesh& input : inputs) {
    const WorkingMesh working = make_working_mesh(triangles(input), 0.1, 0.25);
    const auto euler = [](std::size_t points, std::size_t faces) {
      return static_cast<long>(points) - static_cast<long>(faces) / 2;  // closed: 3 F = 2 E
    };
    EXPECT_EQ(euler(working.triangles.points.size(), working.triangles.faces.size()),
              euler(input.vertices_m.size(), input.faces.size()));
    const Surface surface = make_surface(working.triangles);
    EXPECT_TRUE(surface.is_closed);
    double longest = 0;
    std::size_t short_edges = 0;
    for (const Link& link : surface.links) {
      longest = std::max(longest, link.length * surface.scale_m);
      short_edges += link.length * surface.scale_m < 0.1;
    }
    EXPECT_LT(longest, 0.35);  // a collapse lengthens its neighbours a little
    EXPECT_LT(short_edges, surface.links.size() / 20);
    ASSERT_EQ(working.faces_of_input.size(), input.faces.size());
    for (std::size_t f = 0; f < input.faces.size(); ++f) {
      ASSERT_FALSE(working.faces_of_input[f].empty());
      for (const std::uint32_t g : working.faces_of_input[f]) ASSERT_LT(g, working.triangles.faces.size());
    }
  }
}

#ifdef SQMAP_MESH_DIR

Mesh real_mesh(const std::string& name) {
  std::ifstream in(std::filesystem::path(SQMAP_MESH_DIR) / name);
  std::string magic;
  std::size_t vertices = 0, faces = 0, edges = 0, corners = 0;
  in >> magic >> vertices >> faces >> edges;
  Mesh mesh;
  mesh.vertices_m.resize(vertices);
  for (Vec3d& p : mesh.vertices_m) in >> p.x >> p.y >> p.z;
  mesh.faces.resize(faces);
  for (auto& face : mesh.faces) in >> corners >> face[0] >> face[1] >> face[2];
  EXPECT_TRUE(in) << name;
  test::number_faces(mesh);
  return mesh;
}

TEST(DecomposeElephant, HasConnectedPartsAndItsTrunkIsCutByCurvatureOnly) {
  const Mesh mesh = real_mesh("elephant.off");
  const Decomposition result = segments(mesh);
  EXPECT_GE(result.reasons.size(), 6U);
  EXPECT_LE(result.reasons.size(), 16U);
  EXPECT_TRUE(is_edge_connected(mesh, result.label, result.reasons.size()));
  EXPECT_GT(std::count(result.reasons.begin(), result.reasons.end(), CutReason::kHyperbolic), 0);
  DecomposeOptions without;
  without.use_hyperbolic = false;
  EXPECT_LT(segment_count(mesh, without), result.reasons.size());
}

TEST(DecomposeElephant, FollowsARotation) {
  const Mesh mesh = real_mesh("elephant.off");
  const Decomposition moved = segments(test::transformed(mesh, {{0.9, 0.1, 0.4, -0.2}, {5, 0, 0}}, 100));
  EXPECT_LT(rand_error(mesh, segments(mesh).label, moved.label), 0.02);
}

#endif

}  // namespace
}  // namespace sqmap::bake

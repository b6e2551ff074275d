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
#include "support/shapes.hpp"

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
  EXPECT_TRUE(is_edge_connected(mesh, result.label, result.reasons.size()));
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

TEST(DecomposeElephant, FollowsFacesThatAreCutInFour) {
  const Mesh mesh = real_mesh("elephant.off"), fine = test::subdivided(mesh);
  const Decomposition expected = segments(mesh), cut = segments(fine);
  std::vector<std::uint32_t> inherited(fine.faces.size());
  for (std::size_t f = 0; f < inherited.size(); ++f) inherited[f] = expected.label[fine.source_face[f]];
  EXPECT_EQ(cut.reasons, expected.reasons);
  EXPECT_LT(rand_error(fine, inherited, cut.label), 0.002);
}

#endif

}  // namespace
}  // namespace sqmap::bake

// SPDX-License-Identifier: GPL-3.0-or-later
#include "winding_tree.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <queue>

namespace sqmap::bake {
namespace {

constexpr std::uint32_t kLeafSize = 8;
/// A node counts as far beyond this many of its radii. The largest error measured, with points in and close
/// around six animals of libcgal-demo and a sphere of 1.3e6 faces, is 0.007; first order left 0.024 at 2.5
/// radii.
constexpr double kFarRadii = 2;
/// For a first look, which decides what is farther than kRoughError from a half.
constexpr double kRoughRadii = 1.2;
constexpr double kRoughError = 0.12;

/// A long triangle makes its nodes wide, so that they count as far from few points. Those with an edge above
/// this share of the mesh's size are cut, the longest first, until there are kMostPieces times as many:
/// 2CylinderEngine.glb of assimp-testmodels, whose rounds are slivers, bakes in 24 s for 92 (sqbake bake -v
/// --max-error 0.2% --max-parts 12).
constexpr double kLongEdge = 1.0 / 32;
constexpr std::size_t kMostPieces = 2;
/// Not at the middle: the median holds the centroid, where repair asks of faces that touch.
constexpr double kCutAt = 0.4375;

/// Squared distance, in sizes of the mesh, from where nothing is seen of it; keeps powers of it in range.
constexpr double kGone = 1e60;

double area_x2(const std::array<Vec3d, 3>& t) { return norm(cross(t[1] - t[0], t[2] - t[0])); }
Vec3d centroid(const std::array<Vec3d, 3>& t) { return (1.0 / 3) * (t[0] + t[1] + t[2]); }

/// Sums solid angles of triangles seen from the origin, positive when seen from behind (Van Oosterom and
/// Strackee 1983). Half of each is the argument of a complex number; the numbers are multiplied, and the
/// turns of the product counted, so that the sum takes one arc tangent. A triangle with a corner in the
/// origin adds nothing.
class SolidAngles {
 public:
  void add(const Vec3d& a, const Vec3d& b, const Vec3d& c) {
    const double la = norm(a), lb = norm(b), lc = norm(c);
    const double y = dot(a, cross(b, c));
    const double x = la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb;
    const double size = std::max(std::abs(x), std::abs(y));
    if (!(size > 0)) return;
    multiply(x / size, y / size);
  }
  double sum() const { return 2 * (std::atan2(y_, x_) + 2 * std::numbers::pi * turns_); }

 private:
  void multiply(double x, double y) {
    // Arguments in [0, pi] and in (-pi, 0).
    const bool up = y_ >= 0, other_up = y >= 0, both_back = x_ < 0 && x < 0;
    const double product_x = x_ * x - y_ * y, product_y = x_ * y + y_ * x;
    if (up && other_up && (both_back || (product_x < 0 && product_y < 0))) ++turns_;
    if (!up && !other_up && (both_back || (product_x < 0 && product_y >= 0))) --turns_;
    const double size = std::max(std::abs(product_x), std::abs(product_y));
    x_ = product_x / size;
    y_ = product_y / size;
  }

  double x_ = 1, y_ = 0;
  int turns_ = 0;
};

/// Coefficients of the polynomial (n . r)(d . r) in r.
void add_first(std::array<double, 6>& sum, const Vec3d& n, const Vec3d& d) {
  const std::array<double, 6> terms{
      n.x * d.x, n.y * d.y, n.z * d.z, n.x * d.y + n.y * d.x, n.y * d.z + n.z * d.y, n.z * d.x + n.x * d.z};
  for (std::size_t i = 0; i < terms.size(); ++i) sum[i] += terms[i];
}

/// Coefficients of the polynomial (n . r)(d . r)^2 in r.
void add_second(std::array<double, 10>& sum, const Vec3d& n, const Vec3d& d) {
  const std::array<double, 10> terms{n.x * d.x * d.x,
                                     n.y * d.y * d.y,
                                     n.z * d.z * d.z,
                                     n.y * d.x * d.x + 2 * n.x * d.x * d.y,
                                     n.z * d.x * d.x + 2 * n.x * d.x * d.z,
                                     n.x * d.y * d.y + 2 * n.y * d.y * d.x,
                                     n.z * d.y * d.y + 2 * n.y * d.y * d.z,
                                     n.x * d.z * d.z + 2 * n.z * d.z * d.x,
                                     n.y * d.z * d.z + 2 * n.z * d.z * d.y,
                                     2 * (n.x * d.y * d.z + n.y * d.z * d.x + n.z * d.x * d.y)};
  for (std::size_t i = 0; i < terms.size(); ++i) sum[i] += terms[i];
}

/// The moments against the derivatives of phi = -1/|r|, whose gradient r/|r|^3 is the kernel of the solid
/// angle: d2 phi = I/r^3 - 3 r r/r^5 and d3 phi = -3 sym(I r)/r^5 + 15 r r r/r^7.
double expansion(const Vec3d& r, double r2, const Vec3d& zeroth, const std::array<double, 6>& a,
                 const std::array<double, 10>& b) {
  const double first = a[0] * r.x * r.x + a[1] * r.y * r.y + a[2] * r.z * r.z + a[3] * r.x * r.y +
                       a[4] * r.y * r.z + a[5] * r.z * r.x;
  const double second = r.x * r.x * (b[0] * r.x + b[3] * r.y + b[4] * r.z) +
                        r.y * r.y * (b[5] * r.x + b[1] * r.y + b[6] * r.z) +
                        r.z * r.z * (b[7] * r.x + b[8] * r.y + b[2] * r.z) + b[9] * r.x * r.y * r.z;
  // Thrice the trace of the symmetric tensor: a monomial such as xyy has three of its entries.
  const Vec3d trace{3 * b[0] + b[5] + b[7], b[3] + 3 * b[1] + b[8], b[4] + b[6] + 3 * b[2]};
  const double i2 = 1 / r2, i3 = i2 * std::sqrt(i2);
  return i3 * (dot(zeroth, r) + a[0] + a[1] + a[2] - 1.5 * i2 * dot(trace, r) +
               i2 * (7.5 * i2 * second - 3 * first));
}

/// A triangle by its longest edge, which begins at `corner`.
struct LongTriangle {
  double square;
  std::size_t triangle, corner;
  bool operator<(const LongTriangle& other) const {
    return square != other.square ? square < other.square : triangle > other.triangle;
  }
};

/// Cuts long triangles in two at about the middles of their longest edges, in place and at the end. The
/// surface stays as it is, and so does its winding number.
void cut_long(std::vector<std::array<Vec3d, 3>>& triangles) {
  std::priority_queue<LongTriangle> queue;
  const auto push = [&](std::size_t i) {
    LongTriangle longest{0, i, 0};
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3d edge = triangles[i][(k + 1) % 3] - triangles[i][k];
      if (dot(edge, edge) > longest.square) longest = {dot(edge, edge), i, k};
    }
    if (longest.square > kLongEdge * kLongEdge) queue.push(longest);
  };
  const std::size_t most = kMostPieces * triangles.size();
  for (std::size_t i = 0; i < triangles.size(); ++i) push(i);
  while (!queue.empty() && triangles.size() < most) {
    const auto [square, i, k] = queue.top();
    queue.pop();
    const std::size_t next = (k + 1) % 3;
    const Vec3d middle = (1 - kCutAt) * triangles[i][k] + kCutAt * triangles[i][next];
    std::array<Vec3d, 3> other = triangles[i];
    other[k] = triangles[i][next] = middle;
    triangles.push_back(other);
    push(i);
    push(triangles.size() - 1);
  }
}

std::vector<std::uint32_t> all_of(std::size_t count) {
  std::vector<std::uint32_t> all(count);
  std::iota(all.begin(), all.end(), 0U);
  return all;
}

}  // namespace

WindingTree::WindingTree(const std::vector<Vec3d>& vertices_m,
                         const std::vector<std::array<std::uint32_t, 3>>& faces)
    : WindingTree(vertices_m, faces, all_of(faces.size())) {}

WindingTree::WindingTree(const std::vector<Vec3d>& vertices_m,
                         const std::vector<std::array<std::uint32_t, 3>>& faces,
                         std::span<const std::uint32_t> subset) {
  if (subset.empty()) return;
  Vec3d low = vertices_m[faces[subset[0]][0]], high = low;
  for (const std::uint32_t f : subset)
    for (const std::uint32_t v : faces[f])
      for (int axis = 0; axis < 3; ++axis) {
        low[axis] = std::min(low[axis], vertices_m[v][axis]);
        high[axis] = std::max(high[axis], vertices_m[v][axis]);
      }
  const double size_m = std::max({high.x - low.x, high.y - low.y, high.z - low.z});
  origin_m_ = 0.5 * low + 0.5 * high;
  // One over a subnormal size is infinite: such a mesh is a point and winds round nothing.
  per_m_ = size_m > std::numeric_limits<double>::min() ? 1 / size_m : 0;

  triangles_.reserve(subset.size());
  for (const std::uint32_t f : subset) {
    Triangle& t = triangles_.emplace_back();
    for (std::size_t k = 0; k < 3; ++k) t[k] = per_m_ * (vertices_m[faces[f][k]] - origin_m_);
  }
  cut_long(triangles_);
  nodes_.reserve(triangles_.size() / 2 + 1);
  build(0, static_cast<std::uint32_t>(triangles_.size()));
}

std::uint32_t WindingTree::build(std::uint32_t begin, std::uint32_t end) {
  const auto index = static_cast<std::uint32_t>(nodes_.size());
  nodes_.emplace_back();
  nodes_[index].begin = begin;
  nodes_[index].end = end;
  expand(nodes_[index]);
  if (end - begin <= kLeafSize) return index;

  Vec3d low = centroid(triangles_[begin]), high = low;
  for (std::uint32_t i = begin; i < end; ++i)
    for (int axis = 0; axis < 3; ++axis) {
      const double x = centroid(triangles_[i])[axis];
      low[axis] = std::min(low[axis], x);
      high[axis] = std::max(high[axis], x);
    }
  const Vec3d extent = high - low;
  int axis = extent.y > extent.x ? 1 : 0;
  if (extent.z > extent[axis]) axis = 2;
  const std::uint32_t middle = begin + (end - begin) / 2;
  std::nth_element(
      triangles_.begin() + begin, triangles_.begin() + middle, triangles_.begin() + end,
      [axis](const Triangle& a, const Triangle& b) { return centroid(a)[axis] < centroid(b)[axis]; });
  build(begin, middle);
  nodes_[index].right = build(middle, end);
  return index;
}

void WindingTree::expand(Node& node) const {
  const std::span triangles(triangles_.begin() + node.begin, triangles_.begin() + node.end);
  double area_sum = 0;
  for (const Triangle& t : triangles) {
    const double a = area_x2(t);
    area_sum += a;
    node.centre = node.centre + a * centroid(t);
  }
  node.centre = area_sum > 0 ? (1 / area_sum) * node.centre : centroid(triangles[0]);

  for (const Triangle& t : triangles) {
    const Vec3d n = 0.5 * cross(t[1] - t[0], t[2] - t[0]), d = centroid(t) - node.centre;
    node.zeroth = node.zeroth + n;
    add_first(node.first, n, d);
    // The mean of d d over a triangle is (v1 v1 + v2 v2 + v3 v3 + 9 d d) / 12, d its centroid.
    add_second(node.second, 9.0 / 12 * n, d);
    for (const Vec3d& p : t) {
      add_second(node.second, 1.0 / 12 * n, p - node.centre);
      node.radius_squared = std::max(node.radius_squared, dot(p - node.centre, p - node.centre));
    }
  }
}

double WindingTree::at(const Vec3d& p_m) const { return at(p_m, kFarRadii); }

int WindingTree::rounded_at(const Vec3d& p_m) const {
  double winding = at(p_m, kRoughRadii);
  if (std::isnan(winding)) return 0;
  if (std::abs(winding - std::floor(winding) - 0.5) < kRoughError) winding = at(p_m);
  return static_cast<int>(std::lround(winding));
}

double WindingTree::at(const Vec3d& p_m, double far_radii) const {
  if (nodes_.empty()) return 0;
  const Vec3d q = per_m_ * (p_m - origin_m_);
  if (!std::isfinite(q.x + q.y + q.z)) return std::numeric_limits<double>::quiet_NaN();
  double steradians = 0;
  SolidAngles near_by;
  std::array<std::uint32_t, 64> open{};  // halving 2^32 triangles goes 32 deep
  std::size_t open_count = 1;
  while (open_count > 0) {
    const std::uint32_t index = open[--open_count];
    const Node& node = nodes_[index];
    const Vec3d r = node.centre - q;
    const double d2 = dot(r, r);
    if (d2 > far_radii * far_radii * node.radius_squared) {
      if (d2 > kGone) continue;
      steradians += expansion(r, d2, node.zeroth, node.first, node.second);
    } else if (node.right == 0) {
      for (std::uint32_t i = node.begin; i < node.end; ++i)
        near_by.add(triangles_[i][0] - q, triangles_[i][1] - q, triangles_[i][2] - q);
    } else {
      open[open_count++] = node.right;
      open[open_count++] = index + 1;
    }
  }
  return (steradians + near_by.sum()) / (4 * std::numbers::pi);
}

}  // namespace sqmap::bake

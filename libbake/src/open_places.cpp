// SPDX-License-Identifier: GPL-3.0-or-later
#include "open_places.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>

#include "components.hpp"
#include "edge_table.hpp"

namespace sqmap::bake {

namespace {

constexpr std::size_t kMostBalls = 64;
/// Of the sphere of directions, what the missing surfaces may fill: half of it would change a rounded winding
/// number.
constexpr double kMostShare = 0.25;
constexpr double kRounding = 1 + 1e-6;

struct OpenEdge {
  std::uint32_t a, b;
  int sheets;  ///< faces in one direction that none in the other cancels
};

std::vector<OpenEdge> open_edges(const Mesh& mesh) {
  std::vector<OpenEdge> edges;
  EdgeTable(mesh.faces, mesh.vertices_m.size()).for_each_edge([&](std::span<const std::uint32_t> sides) {
    const std::uint32_t a = side_begin(mesh.faces, sides[0]), b = side_end(mesh.faces, sides[0]);
    int balance = 0;
    for (const std::uint32_t side : sides) balance += side_begin(mesh.faces, side) == a ? 1 : -1;
    if (balance != 0) edges.push_back({a, b, std::abs(balance)});
  });
  return edges;
}

}  // namespace

OpenPlaces::OpenPlaces(const Mesh& mesh) {
  const std::vector<OpenEdge> edges = open_edges(mesh);
  Components joined(mesh.vertices_m.size());
  for (const OpenEdge& edge : edges) joined.join(edge.a, edge.b);
  std::vector<std::uint32_t> roots;
  for (const OpenEdge& edge : edges) roots.push_back(joined.find(edge.a));
  std::sort(roots.begin(), roots.end());
  roots.erase(std::unique(roots.begin(), roots.end()), roots.end());
  everywhere_ = roots.size() > kMostBalls;
  if (everywhere_) return;

  for (const std::uint32_t root : roots) {
    Vec3d sum{};
    double count = 0, ends = 0;
    for (const OpenEdge& edge : edges) {
      if (joined.find(edge.a) != root) continue;
      sum = sum + mesh.vertices_m[edge.a] + mesh.vertices_m[edge.b];
      count += 2;
      ends += edge.sheets;
    }
    Ball ball{(1 / count) * sum, 0, 0};
    std::vector<std::uint32_t> vertices;
    for (const OpenEdge& edge : edges) {
      if (joined.find(edge.a) != root) continue;
      for (const std::uint32_t v : {edge.a, edge.b}) {
        ball.radius_m = std::max(ball.radius_m, norm(mesh.vertices_m[v] - ball.centre_m));
        vertices.push_back(v);
      }
    }
    // A plain loop has as many edges as vertices; each edge more is one end of a further loop at most.
    std::sort(vertices.begin(), vertices.end());
    const auto distinct =
        static_cast<double>(std::unique(vertices.begin(), vertices.end()) - vertices.begin());
    ball.sheets = 1 + std::max(0.0, ends - distinct);
    ball.radius_m *= kRounding;
    balls_.push_back(ball);
  }
}

bool OpenPlaces::can_mislead(const Vec3d& p_m, const Vec3d& direction) const {
  if (everywhere_) return true;
  double share = 0;
  for (const Ball& ball : balls_) {
    const Vec3d d = p_m - ball.centre_m;
    const double square = dot(d, d), along = dot(d, direction), ball_square = ball.radius_m * ball.radius_m;
    if (!(square - along * along > ball_square)) return true;
    share += ball.sheets * 0.5 * (1 - std::sqrt(1 - ball_square / square));
  }
  return share > kMostShare;
}

}  // namespace sqmap::bake

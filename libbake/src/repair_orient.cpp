// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <utility>

#include "repair_steps.hpp"
#include "winding_tree.hpp"

namespace sqmap::bake {
namespace {

constexpr std::uint32_t kNone = 0xFFFFFFFF;

/// An open component that encloses less than this share of area^1.5 is a sheet: it has no outside. (A sphere
/// encloses 0.094, a hemisphere closed by its disc 0.066.)
constexpr double kFlatShare = 1e-3;

/// For each side, the other one of an edge of exactly two faces, whatever their directions; else kNone.
std::vector<std::uint32_t> neighbours(const Mesh& mesh) {
  std::vector<std::uint32_t> other(3 * mesh.faces.size(), kNone);
  EdgeTable(mesh.faces, mesh.vertices_m.size()).for_each_edge([&](std::span<const std::uint32_t> sides) {
    if (sides.size() != 2) return;
    other[sides[0]] = sides[1];
    other[sides[1]] = sides[0];
  });
  return other;
}

/// Walks over all faces, component by component in the order of their first faces, and calls
/// visit(face, component, side it was reached by or kNone).
template <class Visit>
std::uint32_t walk(const Mesh& mesh, const std::vector<std::uint32_t>& neighbour, const Visit& visit) {
  std::vector<bool> seen(mesh.faces.size());
  std::vector<std::uint32_t> queue;
  std::uint32_t component = 0;
  for (std::uint32_t seed = 0; seed < mesh.faces.size(); ++seed) {
    if (seen[seed]) continue;
    seen[seed] = true;
    queue.assign(1, seed);
    visit(seed, component, kNone);
    for (std::size_t at = 0; at < queue.size(); ++at)
      for (std::uint32_t s = 3 * queue[at]; s < 3 * queue[at] + 3; ++s) {
        if (neighbour[s] == kNone || seen[neighbour[s] / 3]) continue;
        seen[neighbour[s] / 3] = true;
        queue.push_back(neighbour[s] / 3);
        visit(neighbour[s] / 3, component, s);
      }
    ++component;
  }
  return component;
}

struct Component {
  std::vector<std::uint32_t> faces;
  Vec3d low_m, high_m;
  int sign = 0;                           ///< +1 faces outwards, -1 inwards, 0 a sheet
  std::vector<std::uint32_t> containers;  ///< components it lies in

  bool may_contain(const Component& other) const {
    for (int axis = 0; axis < 3; ++axis)
      if (other.low_m[axis] < low_m[axis] || other.high_m[axis] > high_m[axis]) return false;
    return true;
  }
};

void turn(Face& face) { std::swap(face[1], face[2]); }

/// Turns the smaller group of faces of each component so that all agree. Components that have only one side,
/// like a Moebius strip, agree except along a line.
std::vector<Component> make_consistent(Mesh& mesh, std::vector<bool>& turned) {
  const std::vector<std::uint32_t> neighbour = neighbours(mesh);
  std::vector<Component> components;
  walk(mesh, neighbour, [&](std::uint32_t face, std::uint32_t component, std::uint32_t from) {
    if (component == components.size()) components.emplace_back();
    components[component].faces.push_back(face);
    if (from == kNone) return;
    const bool agree = side_begin(mesh.faces, from) == side_end(mesh.faces, neighbour[from]);
    const bool is_turned = turned[from / 3];
    turned[face] = agree ? is_turned : !is_turned;
  });
  for (const Component& component : components) {
    const auto count = std::ranges::count_if(component.faces, [&](std::uint32_t f) { return turned[f]; });
    const bool invert = 2 * static_cast<std::size_t>(count) > component.faces.size();
    for (const std::uint32_t f : component.faces) {
      turned[f] = turned[f] != invert;
      if (turned[f]) turn(mesh.faces[f]);
    }
  }
  return components;
}

/// Bounds and sign of a consistent component. An open one is closed in thought by a cone from the middle of
/// its rim.
void measure(Component& component, const Mesh& mesh, const std::vector<std::uint32_t>& twin,
             const MeshScale& scale) {
  const double per_m = 1 / scale.diagonal_m;
  const auto at = [&](std::uint32_t v) { return per_m * (mesh.vertices_m[v] - scale.centre_m); };
  component.low_m = component.high_m = mesh.vertices_m[mesh.faces[component.faces[0]][0]];
  Vec3d rim, first = at(mesh.faces[component.faces[0]][0]);
  double rim_length = 0;
  for (const std::uint32_t f : component.faces)
    for (std::uint32_t k = 0; k < 3; ++k) {
      const std::uint32_t s = 3 * f + k;
      const Vec3d& p_m = mesh.vertices_m[mesh.faces[f][k]];
      for (int axis = 0; axis < 3; ++axis) {
        component.low_m[axis] = std::min(component.low_m[axis], p_m[axis]);
        component.high_m[axis] = std::max(component.high_m[axis], p_m[axis]);
      }
      if (twin[s] < EdgeTable::kBlocked) continue;
      const Vec3d a = at(side_begin(mesh.faces, s)), b = at(side_end(mesh.faces, s));
      rim = rim + norm(b - a) * (0.5 * (a + b));
      rim_length += norm(b - a);
    }
  const Vec3d apex = rim_length > 0 ? (1 / rim_length) * rim : first;
  double six_volumes = 0, two_areas = 0;
  for (const std::uint32_t f : component.faces) {
    const Vec3d a = at(mesh.faces[f][0]) - apex, b = at(mesh.faces[f][1]) - apex,
                c = at(mesh.faces[f][2]) - apex;
    six_volumes += dot(a, cross(b, c));
    two_areas += norm(cross(b - a, c - a));
  }
  const double flat = rim_length > 0 ? kFlatShare * std::pow(two_areas / 2, 1.5) : 0;
  component.sign = six_volumes / 6 > flat ? 1 : six_volumes / 6 < -flat ? -1 : 0;
}

/// Most of a few points of the component have the tree's surface round them.
bool lies_in(const Component& component, const WindingTree& tree, const Mesh& mesh) {
  constexpr std::size_t kProbes = 5;  // not one: components may touch
  std::size_t inside = 0;
  for (std::size_t i = 0; i < kProbes; ++i) {
    const Face& face = mesh.faces[component.faces[i * (component.faces.size() - 1) / (kProbes - 1)]];
    const Vec3d p_m =
        (1.0 / 3) * (mesh.vertices_m[face[0]] + mesh.vertices_m[face[1]] + mesh.vertices_m[face[2]]);
    inside += std::abs(tree.at(p_m)) > 0.5;
  }
  return 2 * inside > kProbes;
}

/// Fills in `containers`, by a sweep along x over the components' boxes and winding numbers where boxes nest.
void find_containers(std::vector<Component>& components, const Mesh& mesh) {
  std::vector<std::uint32_t> order(components.size());
  std::iota(order.begin(), order.end(), 0U);
  // Each number of a box that holds another is at most the other's: the holder comes first.
  const auto extent = [&](std::uint32_t c) {
    const Vec3d &low = components[c].low_m, &high = components[c].high_m;
    return std::array{low.x, -high.x, low.y, -high.y, low.z, -high.z};
  };
  std::ranges::stable_sort(order, {}, extent);
  std::vector<std::vector<std::uint32_t>> candidates(components.size());  // by container
  std::vector<std::uint32_t> open;
  for (const std::uint32_t c : order) {
    std::erase_if(open, [&](std::uint32_t o) { return components[o].high_m.x < components[c].low_m.x; });
    for (const std::uint32_t o : open)
      if (components[o].may_contain(components[c])) candidates[o].push_back(c);
    if (components[c].sign != 0) open.push_back(c);
  }
  for (std::uint32_t o = 0; o < candidates.size(); ++o) {
    if (candidates[o].empty()) continue;
    const WindingTree tree(mesh.vertices_m, mesh.faces, components[o].faces);
    for (const std::uint32_t c : candidates[o])
      if (lies_in(components[c], tree, mesh)) components[c].containers.push_back(o);
  }
}

/// Decides which components to turn. A nest, an outermost component with all it contains, is turned as a
/// whole, so that cavities stay cavities; then what would still leave a negative winding number is turned
/// alone.
std::vector<bool> choose_turns(const std::vector<Component>& components) {
  std::vector<std::uint32_t> order(components.size());
  std::iota(order.begin(), order.end(), 0U);
  std::ranges::stable_sort(order, {}, [&](std::uint32_t c) { return components[c].containers.size(); });
  std::vector<bool> turned(components.size());
  const auto sign = [&](std::uint32_t c) { return turned[c] ? -components[c].sign : components[c].sign; };
  for (const std::uint32_t c : order) {
    const std::vector<std::uint32_t>& around = components[c].containers;
    const auto outermost =
        std::ranges::find_if(around, [&](std::uint32_t o) { return components[o].containers.empty(); });
    if (outermost != around.end()) turned[c] = turned[*outermost];
    int winding = sign(c);
    for (const std::uint32_t o : around) winding += sign(o);
    if (sign(c) < 0 && winding < 0) turned[c] = !turned[c];
  }
  return turned;
}

}  // namespace

std::vector<std::uint32_t> label_components(const Mesh& mesh) {
  std::vector<std::uint32_t> label(mesh.faces.size());
  walk(mesh, neighbours(mesh),
       [&](std::uint32_t face, std::uint32_t component, std::uint32_t) { label[face] = component; });
  return label;
}

std::uint32_t orient(Mesh& mesh, const MeshScale& scale) {
  std::vector<bool> turned(mesh.faces.size());
  std::vector<Component> components = make_consistent(mesh, turned);
  const std::vector<std::uint32_t> twin = EdgeTable(mesh.faces, mesh.vertices_m.size()).twins(mesh.faces);
  for (Component& component : components) measure(component, mesh, twin, scale);
  find_containers(components, mesh);
  const std::vector<bool> turn_component = choose_turns(components);
  for (std::size_t c = 0; c < components.size(); ++c) {
    if (!turn_component[c]) continue;
    for (const std::uint32_t f : components[c].faces) {
      turn(mesh.faces[f]);
      turned[f] = !turned[f];
    }
  }
  return static_cast<std::uint32_t>(std::ranges::count(turned, true));
}

}  // namespace sqmap::bake

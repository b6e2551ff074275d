// SPDX-License-Identifier: GPL-3.0-or-later
#include "drawings.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include <fmt/format.h>

#include "sqmap/asset/superquadric.hpp"
#include "sqmap/bake/oracle.hpp"

#include "../common/png_bytes.hpp"
#include "../sqbake/report/html.hpp"
#include "../sqbake/report/part_picture.hpp"
#include "baked.hpp"
#include "svg.hpp"

namespace sqmap::bench {
namespace {

constexpr std::uint32_t kSide = 260;     ///< pixels of one view
constexpr int kRows = 100, kCols = 200;  ///< the sampling density of the paper's Fig. 4

template <class T>
T value_of(Result<T> result) {
  if (!result) throw std::runtime_error(result.error().finding);
  return std::move(result).value();
}

/// Two unit spheres, their centres 1.3 apart, as one closed surface of revolution.
bake::Mesh two_spheres() {
  constexpr double kPi = std::numbers::pi, kApart = 1.3;
  constexpr int kAround = 96, kHalf = 40;
  const double seam = std::acos(kApart / 2);  // where the two meet, from the line of centres
  bake::Mesh mesh;
  const auto add_ring = [&](double z, double radius) {
    for (int k = 0; k < kAround; ++k) {
      const double angle = 2 * kPi * k / kAround;
      mesh.vertices_m.push_back({radius * std::cos(angle), radius * std::sin(angle), z});
    }
  };
  mesh.vertices_m.push_back({0, 0, -1 - kApart / 2});
  for (int i = 1; i <= kHalf; ++i) {  // the lower sphere up to the seam, in equal angles
    const double angle = (kPi - seam) * i / kHalf;
    add_ring(-kApart / 2 - std::cos(angle), std::sin(angle));
  }
  for (int i = kHalf - 1; i >= 1; --i) {
    const double angle = (kPi - seam) * i / kHalf;
    add_ring(kApart / 2 + std::cos(angle), std::sin(angle));
  }
  mesh.vertices_m.push_back({0, 0, 1 + kApart / 2});
  const auto last = static_cast<std::uint32_t>(mesh.vertices_m.size() - 1);
  const auto at = [](int ring, int k) {
    return static_cast<std::uint32_t>(1 + (ring - 1) * kAround + k % kAround);
  };
  constexpr int kRings = 2 * kHalf - 1;
  for (int k = 0; k < kAround; ++k) {
    mesh.faces.push_back({0, at(1, k + 1), at(1, k)});
    mesh.faces.push_back({last, at(kRings, k), at(kRings, k + 1)});
  }
  for (int ring = 1; ring < kRings; ++ring)
    for (int k = 0; k < kAround; ++k) {
      mesh.faces.push_back({at(ring, k), at(ring, k + 1), at(ring + 1, k + 1)});
      mesh.faces.push_back({at(ring, k), at(ring + 1, k + 1), at(ring + 1, k)});
    }
  return mesh;
}

std::string image(const std::vector<std::uint8_t>& png, double x, double y, double width, double height) {
  return fmt::format(
      "<image x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" href=\"data:image/png;base64,{}\"/>\n", x, y,
      width, height, apps::base64(png));
}

/// The way from the superquadric along its inward normal to the mesh, white where it is longest; row 0 of the
/// picture is the pole at the top.
std::vector<std::uint8_t> map_picture(const Model& model, double& longest_m) {
  const Part& part = model.asset.parts.front();
  const bake::RayTracer tracer(model.mesh);
  const auto turn = rotation(part.object_from_part.orientation);
  std::vector<double> depth_m;
  std::vector<bake::RayTracer::Hit> hits;
  constexpr double kPi = std::numbers::pi;
  for (int r = kRows - 1; r >= 0; --r)
    for (int c = 0; c < kCols; ++c) {
      const double eta = kPi * (r + 0.5) / kRows - kPi / 2, omega = 2 * kPi * c / kCols - kPi;
      const auto on_eta = superellipse_point(std::cos(eta), std::sin(eta), part.shape.e1);
      const auto on_omega = superellipse_point(std::cos(omega), std::sin(omega), part.shape.e2);
      const Vec3d from_m =
          turn.apply(surface_point(part.shape, on_eta, on_omega)) + part.object_from_part.translation_m;
      tracer.trace(from_m, normalized(-turn.apply(surface_normal(part.shape, on_eta, on_omega))), hits);
      depth_m.push_back(hits.empty() ? 0 : hits.front().t_m);
    }
  longest_m = *std::max_element(depth_m.begin(), depth_m.end());
  std::vector<std::uint8_t> pixels;
  for (const double d : depth_m)
    pixels.insert(pixels.end(), 3, static_cast<std::uint8_t>(std::lround(255 * d / longest_m)));
  return value_of(apps::png_bytes(pixels, kCols, kRows, apps::PixelFormat::kRgb));
}

void draw_two_spheres(Results& results) {
  bake::BakeOptions options;
  options.decompose.use_boundary_strength = false;
  options.decompose.use_hyperbolic = false;
  options.max_parts = 1;
  const Model model = baked_model("two spheres", two_spheres(), options);
  const Superquadric& shape = model.asset.parts.front().shape;
  double longest_m = 0;
  const std::vector<std::uint8_t> map = map_picture(model, longest_m);
  const std::string title = "Fig. 4 of the paper: an object of two spheres as one superquadric";
  std::string svg = drawing_svg(
      title, 360,
      image(value_of(apps::part_picture(model.asset, kSide)), 20, 40, 2.0 * kSide, kSide) +
          image(map, 560, 80, 2.8 * kRows, 1.4 * kRows),
      {{20 + kSide / 2.0, 320,
        fmt::format("superquadric: semi-axes {:.3g}, {:.3g}, {:.3g}", shape.semi_axes_m.x,
                    shape.semi_axes_m.y, shape.semi_axes_m.z)},
       {20 + kSide / 2.0, 338,
        fmt::format("radii of the spheres, e1 = {:.3g}, e2 = {:.3g}", shape.e1, shape.e2)},
       {20 + 1.5 * kSide, 320, "the surface that its map represents"},
       {700, 240, fmt::format("map, {} x {}; black: 0, white: {:.3g} radii", kRows, kCols, longest_m)}});
  results.drawings.push_back({kDrawings[0], title, std::move(svg)});
}

}  // namespace

void draw_objects(const SuiteInput& input, Results& results) {
  input.note("bake: drawings");
  draw_two_spheres(results);
  std::string images;
  std::vector<Caption> captions;
  double x = 20, y = 40;
  for (const Model& model : input.models) {
    images += image(value_of(apps::part_picture(model.asset, kSide)), x, y, 400, 200);
    std::size_t segments = 0;
    for (const Part& part : model.asset.parts) segments = std::max<std::size_t>(segments, part.segment + 1);
    captions.push_back(
        {x + 200, y + 216,
         fmt::format("{}: {} parts in {} segments", model.name, model.asset.parts.size(), segments)});
    x = x > 20 ? 20 : 430;
    if (x == 20) y += 240;
  }
  const std::string title = "Fig. 10 of the paper: superquadrics, and the surface of their maps";
  results.drawings.push_back(
      {kDrawings[1], title, drawing_svg(title, y + (x > 20 ? 250 : 10), images, captions)});
}

}  // namespace sqmap::bench

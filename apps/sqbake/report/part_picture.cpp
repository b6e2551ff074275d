// SPDX-License-Identifier: GPL-3.0-or-later
#include "part_picture.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string>

#include "../../common/glb_writer.hpp"
#include "../../common/part_surface.hpp"
#include "../../common/png_bytes.hpp"

namespace sqmap::apps {
namespace {

constexpr std::uint32_t kSamples = 2;  // along each edge of a pixel
constexpr double kMargin = 1.04;
// Finer levels show no difference at the size of a thumbnail.
constexpr std::uint32_t kMostRows = 65;
constexpr double kAmbient = 0.35;

/// Pixel axes and the direction to the viewer, object frame.
struct View {
  Vec3d right, up, towards;
};

View oblique_view() {
  const Vec3d towards = normalized(Vec3d{0.55, -1.0, 0.45});
  const Vec3d right = normalized(cross(Vec3d{0, 0, 1}, towards));
  return {right, cross(towards, right), towards};
}

/// Triangles by depth, with sample colours in linear light.
class Canvas {
 public:
  Canvas(const BoundingSphere& sphere, std::uint32_t side)
      : view_(oblique_view()),
        centre_m_(sphere.centre_m),
        size_(side * kSamples),
        samples_per_m_(size_ / (2 * kMargin * std::max(sphere.radius_m, std::numeric_limits<double>::min()))),
        depth_(std::size_t{size_} * size_, -std::numeric_limits<double>::infinity()),
        color_(depth_.size()) {}

  void draw(const TriangleSurface& surface, const Pose& pose, const GlbScene::Color& color) {
    const Rotation<double> object_from_part = rotation(pose.orientation);
    for (const auto& triangle : surface.triangles) {
      std::array<Vec3d, 3> at;
      std::array<double, 3> light{};
      for (std::size_t k = 0; k < 3; ++k) {
        at[k] = projected(object_from_part.apply(cast<double>(surface.points_m[triangle[k]])) +
                          pose.translation_m);
        const Vec3d normal = object_from_part.apply(cast<double>(surface.normals[triangle[k]]));
        light[k] = kAmbient + (1 - kAmbient) * std::max(0.0, dot(normal, view_.towards));
      }
      fill(at, light, color);
    }
  }

  std::uint32_t size() const noexcept { return size_; }
  bool is_covered(std::uint32_t x, std::uint32_t y) const { return std::isfinite(depth_[place(x, y)]); }
  const std::array<float, 3>& color(std::uint32_t x, std::uint32_t y) const { return color_[place(x, y)]; }

 private:
  std::size_t place(std::uint32_t x, std::uint32_t y) const { return std::size_t{y} * size_ + x; }

  /// Samples right, samples down, metres towards the viewer.
  Vec3d projected(const Vec3d& p_m) const {
    const Vec3d d = p_m - centre_m_;
    return {size_ / 2.0 + samples_per_m_ * dot(d, view_.right),
            size_ / 2.0 - samples_per_m_ * dot(d, view_.up), dot(d, view_.towards)};
  }

  void fill(const std::array<Vec3d, 3>& at, const std::array<double, 3>& light,
            const GlbScene::Color& color) {
    const double area = edge(at[0], at[1], at[2].x, at[2].y);
    if (!(std::abs(area) > 0)) return;  // seen edge-on; NaN
    const auto [low_x, high_x] = std::minmax({at[0].x, at[1].x, at[2].x});
    const auto [low_y, high_y] = std::minmax({at[0].y, at[1].y, at[2].y});
    const double last = size_ - 1;
    for (auto y = static_cast<std::uint32_t>(std::clamp(low_y, 0.0, last));
         y <= std::clamp(high_y, 0.0, last); ++y) {
      for (auto x = static_cast<std::uint32_t>(std::clamp(low_x, 0.0, last));
           x <= std::clamp(high_x, 0.0, last); ++x) {
        const double px = x + 0.5, py = y + 0.5;
        const double a = edge(at[1], at[2], px, py) / area, b = edge(at[2], at[0], px, py) / area,
                     c = 1 - a - b;
        if (a < 0 || b < 0 || c < 0) continue;
        const double depth = a * at[0].z + b * at[1].z + c * at[2].z;
        if (!(depth > depth_[place(x, y)])) continue;
        depth_[place(x, y)] = depth;
        const auto brightness = static_cast<float>(a * light[0] + b * light[1] + c * light[2]);
        color_[place(x, y)] = {brightness * color[0], brightness * color[1], brightness * color[2]};
      }
    }
  }

  static double edge(const Vec3d& p, const Vec3d& q, double x, double y) {
    return (q.x - p.x) * (y - p.y) - (q.y - p.y) * (x - p.x);
  }

  View view_;
  Vec3d centre_m_;
  std::uint32_t size_;
  double samples_per_m_;
  std::vector<double> depth_;
  std::vector<std::array<float, 3>> color_;
};

std::uint8_t display_byte(double linear) {
  return static_cast<std::uint8_t>(std::lround(255 * std::pow(std::clamp(linear, 0.0, 1.0), 1 / 2.2)));
}

/// One pixel: the mean of its samples, opaque as far as they are covered.
std::array<std::uint8_t, 4> pixel(const Canvas& canvas, std::uint32_t x, std::uint32_t y) {
  std::array<double, 3> sum{};
  int covered = 0;
  for (std::uint32_t k = 0; k < kSamples * kSamples; ++k) {
    const std::uint32_t sx = x * kSamples + k % kSamples, sy = y * kSamples + k / kSamples;
    if (!canvas.is_covered(sx, sy)) continue;
    ++covered;
    for (std::size_t channel = 0; channel < 3; ++channel) sum[channel] += canvas.color(sx, sy)[channel];
  }
  if (covered == 0) return {0, 0, 0, 0};
  return {display_byte(sum[0] / covered), display_byte(sum[1] / covered), display_byte(sum[2] / covered),
          static_cast<std::uint8_t>(255 * covered / static_cast<int>(kSamples * kSamples))};
}

std::uint32_t drawn_level(const DistanceMap& map) {
  std::uint32_t level = 0;
  while (level + 1 < map.level_count && ((map.rows - 1) >> level) + 1 > kMostRows) ++level;
  return level;
}

}  // namespace

Result<std::vector<std::uint8_t>> part_picture(const Asset& asset, std::uint32_t side) {
  side = std::clamp<std::uint32_t>(side, 16, 1024);
  Canvas shapes(asset.sphere, side), surface(asset.sphere, side);
  for (std::size_t k = 0; k < asset.parts.size(); ++k) {
    const Part& part = asset.parts[k];
    const GlbScene::Color color = part_color(k, 1);
    shapes.draw(superquadric_surface(part.shape), part.object_from_part, color);
    surface.draw(mapped_surface(part, drawn_level(part.map)), part.object_from_part, color);
  }
  std::vector<std::uint8_t> pixels;
  pixels.reserve(std::size_t{8} * side * side);
  for (std::uint32_t y = 0; y < side; ++y) {
    for (const Canvas* canvas : {&shapes, &surface}) {
      for (std::uint32_t x = 0; x < side; ++x) {
        const auto color = pixel(*canvas, x, y);
        pixels.insert(pixels.end(), color.begin(), color.end());
      }
    }
  }

  return png_bytes(pixels, 2 * side, side, PixelFormat::kRgba);
}

}  // namespace sqmap::apps

// SPDX-License-Identifier: GPL-3.0-or-later
#include "svg.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <string_view>
#include <utility>

#include <fmt/format.h>

namespace sqmap::bench {
namespace {

constexpr std::array<const char*, 20> kColours{"#c0392b", "#e67e22", "#2471a3", "#17a589", "#7d3c98",
                                               "#566573", "#b7950b", "#229954", "#000000", "#ff5ca8",
                                               "#5dade2", "#784212", "#9acd32", "#4a235a", "#f1948a",
                                               "#0b5345", "#f4d03f", "#aab7b8", "#1b4f72", "#a569bd"};
constexpr double kWidth = 860;
constexpr double kLine = 14;           ///< of text
constexpr double kOnRim = 1e-6;        ///< of a decade: rounding
constexpr std::size_t kMostDots = 40;  ///< of a line; more would hide it

/// Methods that occur in several pictures keep their colours. Settings are no part of these names.
constexpr std::array<std::pair<std::string_view, std::size_t>, 12> kUsualColours{
    {{"sqmap-layer3", 0},
     {"sqmap-layer2", 1},
     {"grid-int16-simd", 2},
     {"grid-float-simd", 3},
     {"bricks-8bit-simd", 4},
     {"fcl-obb-all-contacts", 5},
     {"sqmap-layer3-tracked", 7},
     {"mesh-normals", 8},
     {"sqmap-layer3-smoothed", 9},
     {"grid-int16-simd-culled", 10},
     {"mesh-shaded", 11},
     {"embree-closest", 18}}};

/// "grid-int16-128-simd" without its 128.
std::string without_setting(const std::string& name) {
  std::string kept;
  std::size_t begin = 0;
  while (begin < name.size()) {
    const std::size_t end = std::min(name.find('-', begin), name.size());
    const std::string word = name.substr(begin, end - begin);
    if (word.find_first_not_of("0123456789x.") != std::string::npos) kept += (kept.empty() ? "" : "-") + word;
    begin = end + 1;
  }
  return kept;
}

/// The usual ones first; the others take what is left, in their order.
std::vector<const char*> colours_of(const std::vector<std::string>& names) {
  std::vector<const char*> colours(names.size(), nullptr);
  std::array<bool, kColours.size()> is_taken{};
  const auto take = [&](std::size_t i, std::size_t colour) {
    colours[i] = kColours[colour];
    is_taken[colour] = true;
  };
  for (std::size_t i = 0; i < names.size(); ++i)
    for (const auto& [name, colour] : kUsualColours)
      if (!is_taken[colour] && without_setting(names[i]) == name) take(i, colour);
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (colours[i] != nullptr) continue;
    const auto next =
        static_cast<std::size_t>(std::find(is_taken.begin(), is_taken.end(), false) - is_taken.begin());
    take(i, next < kColours.size() ? next : i % kColours.size());
  }
  return colours;
}

template <class Named>
std::vector<const char*> colours_of(const std::vector<Named>& all) {
  std::vector<std::string> names;
  for (const Named& one : all) names.push_back(one.name);
  return colours_of(names);
}

/// What a reader looks for first.
const char* weight_of(const std::string& name) {
  return name.starts_with("sqmap") ? "font-weight=\"bold\"" : "";
}

std::string opening(double height, const std::string& title) {
  return fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {0} {1}\" width=\"{0}\" height=\"{1}\" "
      "font-family=\"sans-serif\" font-size=\"12\">\n<rect width=\"{0}\" height=\"{1}\" fill=\"white\"/>\n"
      "<text x=\"16\" y=\"22\" font-size=\"15\" font-weight=\"bold\">{2}</text>\n",
      kWidth, height, escaped(title));
}

std::string text(double x, double y, const char* anchor, const std::string& words, const char* more = "") {
  return fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"{}\" {}>{}</text>\n", x, y, anchor, more,
                     escaped(words));
}

/// A logarithmic axis from and to 1, 2 or 5 times a power of ten, or a linear one over whole steps.
struct Axis {
  double low, high;      // exponents of ten, or values
  double begin, length;  // on the page; negative length: upwards
  double step = 0;       // between ticks; 0: logarithmic
  double place(double u) const { return begin + (u - low) / (high - low) * length; }
  double at(double value) const { return place(step > 0 ? value : std::log10(value)); }
};

/// The exponent of the nearest 1, 2 or 5 times a power of ten that is not above, or not below, 10^u.
double round_exponent(double u, bool is_up) {
  // A value on a tick lies on the rim, for all the rounding of its logarithm.
  constexpr double kRounding = 1e-9;
  const double decade = std::floor(u + kRounding);
  double best = is_up ? decade + 1 : decade;
  for (const double mantissa : {1.0, 2.0, 5.0}) {
    const double tick = decade + std::log10(mantissa);
    if (is_up ? tick >= u - kRounding && tick < best : tick <= u + kRounding && tick > best) best = tick;
  }
  return best;
}

Axis axis_over(double least, double most, double begin, double length) {
  const double low = round_exponent(std::log10(least), false), high = round_exponent(std::log10(most), true);
  return {low, high > low ? high : low + 1, begin, length};
}

/// Ticks at 1, 2 or 5 times a power of ten, at least four of them.
Axis linear_axis(double least, double most, double begin, double length) {
  const double range = std::max(most - least, 1e-12 + 1e-9 * std::abs(most));
  double step = std::pow(10.0, std::floor(std::log10(range)));
  if (range / step < 2)
    step /= 5;
  else if (range / step < 4)
    step /= 2;
  return {step * std::floor(least / step + 1e-9), step * std::ceil(most / step - 1e-9), begin, length, step};
}

std::string power_of_ten(int mantissa, int exponent) {
  return exponent >= -4 && exponent <= 5 ? fmt::format("{:g}", mantissa * std::pow(10.0, exponent))
                                         : fmt::format("{}e{}", mantissa, exponent);
}

/// Three digits, without an exponent.
std::string plain(double value) {
  if (!(value > 0)) return fmt::format("{:g}", value);
  const int digits = 2 - static_cast<int>(std::floor(std::log10(value)));
  const double unit = std::pow(10.0, digits);
  return fmt::format("{:.{}f}", std::round(value * unit) / unit, std::max(digits, 0));
}

struct Tick {
  double at;
  std::string words;
};
std::vector<Tick> ticks_of(const Axis& axis) {
  std::vector<Tick> ticks;
  if (axis.step > 0) {
    const auto count = static_cast<int>(std::lround((axis.high - axis.low) / axis.step));
    for (int i = 0; i <= count; ++i) {
      const double value = axis.low + i * axis.step;  // a sum of steps misses zero by their rounding
      ticks.push_back(
          {axis.at(value), fmt::format("{:.4g}", std::abs(value) < 1e-9 * axis.step ? 0 : value)});
    }
    return ticks;
  }
  // Few powers of ten: those between tell the scale too.
  const bool is_short = axis.high - axis.low < 2.5;
  for (int e = static_cast<int>(std::floor(axis.low)); e <= static_cast<int>(std::ceil(axis.high)); ++e)
    for (const int mantissa : {1, 2, 5}) {
      const double u = e + std::log10(mantissa);
      if ((mantissa == 1 || is_short) && u > axis.low - kOnRim && u < axis.high + kOnRim)
        ticks.push_back({axis.place(u), power_of_ten(mantissa, e)});
    }
  return ticks;
}

/// Places of 2 to 9 times the powers of ten.
std::vector<double> between_decades(const Axis& axis) {
  std::vector<double> places;
  if (axis.step > 0) return places;
  for (int e = static_cast<int>(std::floor(axis.low)); e <= static_cast<int>(std::ceil(axis.high)); ++e)
    for (int k = 2; k < 10; ++k)
      if (const double u = e + std::log10(k); u > axis.low && u < axis.high) places.push_back(axis.place(u));
  return places;
}

/// Grid lines, their numbers and the titles of both axes.
std::string frame_of(const Axis& x, const Axis& y, const std::string& x_title, const std::string& y_title) {
  const double left = x.begin, right = x.begin + x.length, bottom = y.begin, top = y.begin + y.length;
  std::string svg;
  for (const double at : between_decades(x))
    svg += fmt::format("<line x1=\"{0:.1f}\" x2=\"{0:.1f}\" y1=\"{1}\" y2=\"{2}\" stroke=\"#f3f3f3\"/>\n", at,
                       top, bottom);
  for (const double at : between_decades(y))
    svg += fmt::format("<line x1=\"{1}\" x2=\"{2}\" y1=\"{0:.1f}\" y2=\"{0:.1f}\" stroke=\"#f3f3f3\"/>\n", at,
                       left, right);
  for (const auto& [at, words] : ticks_of(x)) {
    svg += fmt::format("<line x1=\"{0:.1f}\" x2=\"{0:.1f}\" y1=\"{1}\" y2=\"{2}\" stroke=\"#ddd\"/>\n", at,
                       top, bottom);
    svg += text(at, bottom + 18, "middle", words);
  }
  double labelled = std::numeric_limits<double>::infinity();
  for (const auto& [at, words] : ticks_of(y)) {
    svg += fmt::format("<line x1=\"{1}\" x2=\"{2}\" y1=\"{0:.1f}\" y2=\"{0:.1f}\" stroke=\"#ddd\"/>\n", at,
                       left, right);
    if (std::abs(at - labelled) < kLine) continue;
    svg += text(left - 8, at + 4, "end", words);
    labelled = at;
  }
  svg += text((left + right) / 2, bottom + 40, "middle", x_title);
  return svg + text(20, (top + bottom) / 2, "middle", y_title,
                    fmt::format("transform=\"rotate(-90 20 {})\"", (top + bottom) / 2).c_str());
}

bool is_drawn(const Line& line, std::size_t i, bool is_logarithmic) {
  return std::isfinite(line.x[i]) && std::isfinite(line.y[i]) &&
         (!is_logarithmic || (line.x[i] > 0 && line.y[i] > 0 && (line.lower.empty() || line.lower[i] > 0)));
}

struct Bounds {
  double x_low, x_high, y_low, y_high;  ///< infinite where nothing is drawn
};
/// Linear axes begin at zero where that spares no more than half of them.
Bounds bounds_of(const std::vector<Line>& lines, bool is_logarithmic) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  Bounds b{kInfinity, -kInfinity, kInfinity, -kInfinity};
  for (const Line& line : lines)
    for (std::size_t i = 0; i < line.x.size(); ++i) {
      if (!is_drawn(line, i, is_logarithmic)) continue;
      b.x_low = std::min(b.x_low, line.x[i]);
      b.x_high = std::max(b.x_high, line.x[i]);
      b.y_low = std::min(b.y_low, line.lower.empty() ? line.y[i] : line.lower[i]);
      b.y_high = std::max(b.y_high, line.upper.empty() ? line.y[i] : line.upper[i]);
    }
  if (!is_logarithmic && b.y_low < 0.5 * b.y_high) b.y_low = std::min(b.y_low, 0.0);
  return b;
}

std::string path_of(const Line& line, const Axis& x, const Axis& y, bool is_logarithmic, const char* colour) {
  std::string path;
  bool is_down = false;
  for (std::size_t i = 0; i < line.x.size(); ++i) {
    const bool is_here = is_drawn(line, i, is_logarithmic);
    if (is_here)
      path += fmt::format("{}{:.1f} {:.1f} ", is_down ? "L" : "M", x.at(line.x[i]), y.at(line.y[i]));
    is_down = is_here;
  }
  return fmt::format("<path d=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"1.4\"/>\n", path, colour);
}

/// From the lower bounds of the points that are drawn, in their order, back along the upper ones.
std::string band_of(const Line& line, const Axis& x, const Axis& y, bool is_logarithmic, const char* colour) {
  std::string there, back;
  for (std::size_t i = 0; i < line.lower.size(); ++i) {
    if (!is_drawn(line, i, is_logarithmic)) continue;
    there += fmt::format("{:.1f},{:.1f} ", x.at(line.x[i]), y.at(line.lower[i]));
    back.insert(0, fmt::format("{:.1f},{:.1f} ", x.at(line.x[i]), y.at(line.upper[i])));
  }
  if (there.empty()) return {};
  return fmt::format("<polygon points=\"{0}{1}\" fill=\"{2}\" stroke=\"{2}\" opacity=\"0.25\"/>\n", there,
                     back, colour);
}

double disc_radius(double bytes) { return 2 + 0.8 * std::log2(std::max(bytes, 1024.0) / 1024); }

}  // namespace

std::string escaped(const std::string& words) {
  std::string out;
  for (const char c : words)
    out += c == '<'   ? "&lt;"
           : c == '>' ? "&gt;"
           : c == '&' ? "&amp;"
           : c == '"' ? "&quot;"
                      : std::string(1, c);
  return out;
}

std::string scatter_svg(const std::string& title, const std::string& x_title, const std::string& y_title,
                        const std::vector<Series>& series) {
  constexpr double kLeft = 80, kRight = 610, kTop = 44, kBottom = 500;
  const double height = std::max(560.0, kTop + 20.0 * static_cast<double>(series.size()) + 160);
  double x_low = std::numeric_limits<double>::infinity(), x_high = 0, y_low = x_low, y_high = 0;
  for (const Series& one : series)
    for (const Disc& disc : one.discs) {
      x_low = std::min(x_low, disc.x);
      x_high = std::max(x_high, disc.x);
      y_low = std::min(y_low, std::fmin(disc.y, disc.lower));  // NaN: y
      y_high = std::max(y_high, std::fmax(disc.y, disc.upper));
    }
  std::string svg = opening(height, title);
  if (!(x_low > 0) || !(y_low > 0) || !std::isfinite(x_low))
    return svg + text(kLeft, 60, "start", "no values") + "</svg>\n";
  const Axis x = axis_over(x_low, x_high, kLeft, kRight - kLeft),
             y = axis_over(y_low, y_high, kBottom, kTop - kBottom);
  svg += frame_of(x, y, x_title, y_title);
  double legend = kTop + 12;
  const std::vector<const char*> colours = colours_of(series);
  std::string ours;  // above the others
  bool has_quartiles = false;
  for (std::size_t i = 0; i < series.size(); ++i) {
    const char* colour = colours[i];
    const bool is_ours = series[i].name.starts_with("sqmap");
    std::string& drawn = is_ours ? ours : svg;
    std::string line;
    for (const Disc& disc : series[i].discs)
      line += fmt::format("{:.1f},{:.1f} ", x.at(disc.x), y.at(disc.y));
    drawn += fmt::format(
        "<polyline points=\"{}\" fill=\"none\" stroke=\"{}\" stroke-opacity=\"{}\" stroke-width=\"{}\"/>\n",
        line, colour, is_ours ? 0.9 : 0.5, is_ours ? 2 : 1);
    for (const Disc& disc : series[i].discs) {
      if (disc.lower > 0)
        drawn += fmt::format(
            "<line class=\"quartiles\" x1=\"{0:.1f}\" x2=\"{0:.1f}\" y1=\"{1:.1f}\" y2=\"{2:.1f}\" "
            "stroke=\"{3}\"/>\n",
            x.at(disc.x), y.at(disc.lower), y.at(disc.upper), colour);
      drawn += fmt::format(
          "<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"{:.1f}\" fill=\"{}\" fill-opacity=\"{}\" "
          "stroke=\"{}\"><title>{}</title></circle>\n",
          x.at(disc.x), y.at(disc.y), disc_radius(disc.bytes), colour, is_ours ? 0.6 : 0.3, colour,
          escaped(disc.label));
      has_quartiles |= disc.lower > 0;
    }
    svg +=
        fmt::format("<circle cx=\"{}\" cy=\"{}\" r=\"5\" fill=\"{}\"/>\n", kRight + 24, legend - 4, colour);
    svg += text(kRight + 36, legend, "start", series[i].name, weight_of(series[i].name));
    legend += 20;
  }
  svg += ours;
  svg += text(kRight + 18, legend + 16, "start", "size of a disc: memory");
  legend += 44;
  for (const auto& [bytes, name] :
       {std::pair{1024.0 * 64, "64 KB"}, {1024.0 * 1024, "1 MB"}, {1024.0 * 1024 * 16, "16 MB"}}) {
    const double r = disc_radius(bytes);
    svg += fmt::format("<circle cx=\"{}\" cy=\"{:.1f}\" r=\"{:.1f}\" fill=\"none\" stroke=\"#555\"/>\n",
                       kRight + 44, legend + r, r);
    svg += text(kRight + 80, legend + r + 4, "start", name);
    legend += 2 * r + 8;
  }
  if (has_quartiles) svg += text(kRight + 18, legend + 16, "start", "line through a disc: quartiles");
  return svg + "</svg>\n";
}

std::string lines_svg(const std::string& title, const std::string& x_title, const std::string& y_title,
                      const std::vector<Line>& lines, bool is_logarithmic) {
  constexpr double kHeight = 420, kLeft = 80, kRight = 610, kTop = 44, kBottom = 360;
  const Bounds bounds = bounds_of(lines, is_logarithmic);
  std::string svg = opening(kHeight, title);
  if (!std::isfinite(bounds.x_low)) return svg + text(kLeft, 60, "start", "no values") + "</svg>\n";
  const auto axis = is_logarithmic ? axis_over : linear_axis;
  const Axis x = axis(bounds.x_low, bounds.x_high, kLeft, kRight - kLeft),
             y = axis(bounds.y_low, bounds.y_high, kBottom, kTop - kBottom);
  svg += frame_of(x, y, x_title, y_title);
  double legend = kTop + 12;
  const std::vector<const char*> colours = colours_of(lines);
  for (std::size_t l = 0; l < lines.size(); ++l)  // below all lines
    svg += band_of(lines[l], x, y, is_logarithmic, colours[l]);
  for (std::size_t l = 0; l < lines.size(); ++l) {
    const Line& line = lines[l];
    const char* colour = colours[l];
    svg += path_of(line, x, y, is_logarithmic, colour);
    if (line.x.size() <= kMostDots)
      for (std::size_t i = 0; i < line.x.size(); ++i)
        if (is_drawn(line, i, is_logarithmic))
          svg += fmt::format(
              "<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"3\" fill=\"{}\"><title>{}: {:.4g}, "
              "{:.4g}{}</title></circle>\n",
              x.at(line.x[i]), y.at(line.y[i]), colour, escaped(line.name), line.x[i], line.y[i],
              line.lower.empty() ? "" : fmt::format(" ({:.4g} to {:.4g})", line.lower[i], line.upper[i]));
    svg += fmt::format("<rect x=\"{}\" y=\"{}\" width=\"16\" height=\"4\" fill=\"{}\"/>\n", kRight + 14,
                       legend - 6, colour);
    svg += text(kRight + 36, legend, "start", line.name, weight_of(line.name));
    legend += 20;
  }
  if (std::any_of(lines.begin(), lines.end(), [](const Line& line) { return !line.lower.empty(); }))
    svg += text(kRight + 36, legend, "start", "band: quartiles");
  return svg + "</svg>\n";
}

std::string panels_svg(const std::string& title, const std::string& x_title, const std::string& y_title,
                       const std::vector<Line>& lines) {
  constexpr double kLeft = 80, kRight = 610, kTop = 44, kPanel = 84, kGap = 22;
  const double height = kTop + (kPanel + kGap) * static_cast<double>(lines.size()) + 36;
  std::string svg = opening(height, title);
  const Bounds bounds = bounds_of(lines, false);
  if (!std::isfinite(bounds.x_low)) return svg + text(kLeft, 60, "start", "no values") + "</svg>\n";
  const Axis x = linear_axis(bounds.x_low, bounds.x_high, kLeft, kRight - kLeft);
  const std::vector<const char*> colours = colours_of(lines);
  double top = kTop;
  for (std::size_t l = 0; l < lines.size(); ++l) {
    const Axis y = linear_axis(bounds.y_low, bounds.y_high, top + kPanel, -kPanel);
    svg += frame_of(x, y, l + 1 == lines.size() ? x_title : "", "");
    svg += path_of(lines[l], x, y, false, colours[l]);
    svg += text(kRight + 14, top + 16, "start", lines[l].name, weight_of(lines[l].name));
    top += kPanel + kGap;
  }
  const double middle = kTop + (top - kGap - kTop) / 2;
  return svg +
         text(20, middle, "middle", y_title, fmt::format("transform=\"rotate(-90 20 {})\"", middle).c_str()) +
         "</svg>\n";
}

std::string bars_svg(const std::string& title, const std::string& x_title, const std::vector<Bar>& bars) {
  constexpr double kLeast = 230, kLetter = 7.5, kRight = 780, kTop = 44, kRow = 22;
  std::size_t longest = 0;
  for (const Bar& bar : bars) longest = std::max(longest, bar.name.size());
  const double left = std::max(kLeast, kLetter * static_cast<double>(longest) + 16);
  const double bottom = kTop + kRow * static_cast<double>(bars.size());
  double least = std::numeric_limits<double>::infinity(), most = 0;
  for (const Bar& bar : bars) {
    least = std::min(least, bar.lower);
    most = std::max(most, bar.upper);
  }
  std::string svg = opening(bottom + 50, title);
  if (!(least > 0) || !std::isfinite(least)) return svg + text(left, 60, "start", "no values") + "</svg>\n";
  const Axis x = axis_over(least, most, left, kRight - left);
  for (const auto& [at, words] : ticks_of(x)) {
    svg += fmt::format("<line x1=\"{0:.1f}\" x2=\"{0:.1f}\" y1=\"{1}\" y2=\"{2}\" stroke=\"#ddd\"/>\n", at,
                       kTop, bottom);
    svg += text(at, bottom + 16, "middle", words);
  }
  svg += text((left + kRight) / 2, bottom + 38, "middle", x_title);
  double y = kTop;
  for (const Bar& bar : bars) {
    svg += text(left - 8, y + 15, "end", bar.name, bar.is_ours ? "font-weight=\"bold\"" : "");
    const char* colour = bar.is_ours ? "#c0392b" : "#2471a3";
    svg += fmt::format("<line x1=\"{}\" x2=\"{}\" y1=\"{:.1f}\" y2=\"{:.1f}\" stroke=\"#eee\"/>\n", left,
                       kRight, y + 11, y + 11);
    svg += fmt::format(
        "<line x1=\"{:.1f}\" x2=\"{:.1f}\" y1=\"{:.1f}\" y2=\"{:.1f}\" stroke=\"{}\" stroke-width=\"4\" "
        "stroke-opacity=\"0.35\"/>\n",
        x.at(bar.lower), x.at(bar.upper), y + 11, y + 11, colour);
    svg += fmt::format("<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"5\" fill=\"{}\"/>\n", x.at(bar.value), y + 11,
                       colour);
    svg += text(x.at(bar.upper) + 8, y + 15, "start", plain(bar.value));
    y += kRow;
  }
  return svg + "</svg>\n";
}

std::string drawing_svg(const std::string& title, double height, const std::string& inner,
                        const std::vector<Caption>& captions) {
  std::string svg = opening(height, title) + inner;
  for (const Caption& caption : captions) svg += text(caption.x, caption.y, "middle", caption.words);
  return svg + "</svg>\n";
}

}  // namespace sqmap::bench

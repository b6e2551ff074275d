// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <limits>
#include <string>
#include <vector>

namespace sqmap::bench {

/// One disc of a scatter plot with logarithmic axes; both values must be positive.
struct Disc {
  double x{}, y{}, bytes{};  ///< bytes: the disc's radius, on a logarithmic scale from 1 KB on
  std::string label;         ///< shown when the pointer rests on it
  /// Quartiles of y, drawn as a line through the disc; NaN: none.
  double lower = std::numeric_limits<double>::quiet_NaN(), upper = lower;
};
/// Discs of one colour, joined by a line in their order.
struct Series {
  std::string name;
  std::vector<Disc> discs;
};
std::string scatter_svg(const std::string& title, const std::string& x_title, const std::string& y_title,
                        const std::vector<Series>& series);

/// Points joined in their order.
struct Line {
  std::string name;
  std::vector<double> x, y;              ///< equally many; a NaN breaks the line
  std::vector<double> lower{}, upper{};  ///< quartiles of y, a band around the line; as many, or none
};
/// `is_logarithmic`: both axes; only positive values are drawn then.
std::string lines_svg(const std::string& title, const std::string& x_title, const std::string& y_title,
                      const std::vector<Line>& lines, bool is_logarithmic);

/// The same over linear axes, each line in a panel of its own: for lines that would hide each other.
std::string panels_svg(const std::string& title, const std::string& x_title, const std::string& y_title,
                       const std::vector<Line>& lines);

/// A value, and the least and the greatest of what it is the mean of.
struct Bar {
  std::string name;
  double value{}, lower{}, upper{};
  bool is_ours{};
};
/// Dots on a line each, over a logarithmic axis: the length of a bar would mean nothing there.
std::string bars_svg(const std::string& title, const std::string& x_title, const std::vector<Bar>& bars);

struct Caption {
  double x{}, y{};  ///< of its middle
  std::string words;
};
/// Markup of the caller's under a title.
std::string drawing_svg(const std::string& title, double height, const std::string& inner,
                        const std::vector<Caption>& captions);

/// `text` with the characters that markup reserves written as entities.
std::string escaped(const std::string& text);

}  // namespace sqmap::bench

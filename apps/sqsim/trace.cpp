// SPDX-License-Identifier: Apache-2.0
#include "trace.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <iterator>

#include <fmt/format.h>

namespace sqmap::apps {
namespace {

// Drawing area of one panel and the room beside it, in pixels.
constexpr double kWidth = 900, kHeight = 150, kLeft = 80, kGap = 50;
// More points than pixels would only make the file large: each pixel keeps its least and its greatest.
constexpr std::size_t kColumns = 900;

std::string escaped(const std::string& text) {
  std::string result;
  for (const char c : text) {
    if (c == '&')
      result += "&amp;";
    else if (c == '<')
      result += "&lt;";
    else
      result += c;
  }
  return result;
}

using Value = std::function<double(const TraceRow&)>;

std::string panel(std::span<const TraceRow> rows, const std::string& label, const Value& value, double top) {
  double most = 0;
  for (const TraceRow& row : rows) most = std::max(most, value(row));
  if (!(most > 0)) most = 1;
  const double begin_s = rows.front().time_s, span_s = std::max(rows.back().time_s - begin_s, 1e-9);
  std::string line;
  for (std::size_t column = 0; column < kColumns; ++column) {
    const std::size_t from = rows.size() * column / kColumns, to = rows.size() * (column + 1) / kColumns;
    if (from == to) continue;
    const auto slice = rows.subspan(from, to - from);
    const auto [low, high] = std::ranges::minmax(slice, {}, value);
    for (const TraceRow* row : {&low, &high})
      fmt::format_to(std::back_inserter(line), "{:.1f},{:.1f} ",
                     kLeft + kWidth * (row->time_s - begin_s) / span_s,
                     top + kHeight * (1 - value(*row) / most));
  }
  return fmt::format(
      "<rect x='{0}' y='{1}' width='{2}' height='{3}' fill='none' stroke='#999'/>\n"
      "<text x='{0}' y='{4}'>{5}</text>\n"
      "<text x='{6}' y='{7}' text-anchor='end'>{8:.4g}</text><text x='{6}' y='{9}' "
      "text-anchor='end'>0</text>\n"
      "<polyline fill='none' stroke='#1f5fa8' points='{10}'/>\n",
      kLeft, top, kWidth, kHeight, top - 6, label, kLeft - 6, top + 12, most, top + kHeight, line);
}

}  // namespace

std::string trace_csv(std::span<const TraceRow> rows) {
  std::string text =
      "time_s,x_m,y_m,z_m,qw,qx,qy,qz,force_x_n,force_y_n,force_z_n,torque_x_nm,torque_y_nm,torque_z_nm,"
      "contacts,"
      "layer,microseconds,deepest_m,work_units\n";
  for (const TraceRow& row : rows) {
    const Vec3d& p = row.pose.translation_m;
    const Quaternion& q = row.pose.orientation;
    fmt::format_to(std::back_inserter(text), "{:.6f},{:.7g},{:.7g},{:.7g},{:.7g},{:.7g},{:.7g},{:.7g},",
                   row.time_s, p.x, p.y, p.z, q.w, q.x, q.y, q.z);
    fmt::format_to(std::back_inserter(text),
                   "{:.6g},{:.6g},{:.6g},{:.6g},{:.6g},{:.6g},{},{},{:.2f},{:.6g},{}\n", row.force_n.x,
                   row.force_n.y, row.force_n.z, row.torque_nm.x, row.torque_nm.y, row.torque_nm.z,
                   row.contacts, row.layer, row.microseconds, row.deepest_m, row.work_units);
  }
  return text;
}

std::string trace_svg(std::span<const TraceRow> rows, const std::string& title) {
  const double height = 3 * (kHeight + kGap) + kGap + 20;
  std::string text = fmt::format(
      "<svg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 {0} {1}' width='{0}' height='{1}' "
      "font-family='sans-serif' "
      "font-size='13'>\n<rect width='100%' height='100%' fill='#fff'/>\n<text x='{2}' y='24' "
      "font-size='16'>{3}</text>\n",
      kLeft + kWidth + 20, height, kLeft, escaped(title));
  if (!rows.empty()) {
    double top = kGap + 20;
    const std::pair<const char*, Value> panels[] = {
        {"force [N]", [](const TraceRow& row) { return static_cast<double>(norm(row.force_n)); }},
        {"contacts", [](const TraceRow& row) { return static_cast<double>(row.contacts); }},
        {"frame time [microseconds]", [](const TraceRow& row) { return row.microseconds; }}};
    for (const auto& [label, value] : panels) {
      text += panel(rows, label, value, top);
      top += kHeight + kGap;
    }
    text += fmt::format(
        "<text x='{}' y='{}'>{:.3g} s</text><text x='{}' y='{}' text-anchor='end'>{:.3g} s</text>\n", kLeft,
        top - kGap + 18, rows.front().time_s, kLeft + kWidth, top - kGap + 18, rows.back().time_s);
  }
  return text + "</svg>\n";
}

Jumps force_jumps(std::span<const TraceRow> rows) {
  Jumps result;
  for (std::size_t i = 1; i < rows.size(); ++i) {
    if (rows[i].contacts == 0 || rows[i - 1].contacts == 0) continue;
    ++result.steps;
    const float larger_n = std::max(norm(rows[i].force_n), norm(rows[i - 1].force_n));
    const float change_n = norm(rows[i].force_n - rows[i - 1].force_n);
    result.most_n = std::max(result.most_n, static_cast<double>(change_n));
    if (!(change_n > 0.1F * larger_n)) continue;
    ++result.jumps;
    result.firm_jumps += static_cast<double>(larger_n) > kFirm_n ? 1 : 0;
  }
  return result;
}

}  // namespace sqmap::apps

// SPDX-License-Identifier: GPL-3.0-or-later
#include "report_page.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numeric>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "sqmap/io/bundle.hpp"

#include "html.hpp"
#include "part_picture.hpp"

namespace sqmap::apps {
namespace {

constexpr std::size_t kRanked = 12;          // rows of "largest errors" and "slowest"
constexpr std::uint32_t kPictureSide = 150;  // pixels

constexpr const char* kStyle =
    ":root{color-scheme:light dark}"
    "body{font:15px/1.45 system-ui,sans-serif;max-width:70em;margin:2em auto;padding:0 1em}"
    "table{border-collapse:collapse;margin:1em 0;font-size:13px;font-variant-numeric:tabular-nums}"
    "td,th{padding:3px 9px;border-bottom:1px solid #8886;text-align:right;vertical-align:top}"
    "td.t,th.t{text-align:left;overflow-wrap:break-word;min-width:7em;max-width:30em}"
    "th button{all:unset;cursor:pointer}th button:focus-visible{outline:2px solid}"
    ".bar{display:flex;width:16em;height:1.1em}.bar i{display:block;min-width:1px}"
    ".gallery{display:flex;flex-wrap:wrap;gap:1em}figure{margin:0;width:300px;font-size:13px}"
    "figure img{display:block;background:#fff;border:1px solid #8886}figcaption{overflow-wrap:anywhere}"
    ".good{color:#1a7f37}.bad{color:#cf222e}.warn{color:#9a6700}"
    "@media(prefers-color-scheme:dark){.good{color:#3fb950}.bad{color:#f85149}.warn{color:#d29922}}";

// Sorts a table by the column whose head is pressed, and shows the rows that hold the words of the field.
constexpr const char* kScript =
    "for(const b of document.querySelectorAll('th button'))b.onclick=()=>{"
    "const h=b.parentNode,t=h.closest('table').tBodies[0],k=h.cellIndex,d=h.ariaSort=='descending'?1:-1;"
    "for(const o of "
    "h.parentNode.cells)o.removeAttribute('aria-sort');h.ariaSort=d<0?'descending':'ascending';"
    "const v=r=>{const c=r.cells[k],n=c.dataset.v;return n===undefined?c.textContent:n===''?-Infinity:+n};"
    "t.append(...[...t.rows].sort((p,q)=>{const x=v(p),y=v(q);return d*(x<y?-1:x>y?1:0)}))};"
    "const f=document.querySelector('#filter');if(f)f.oninput=()=>{for(const r of "
    "document.querySelector('#all').tBodies[0].rows)r.hidden=!r.textContent.toLowerCase().includes("
    "f.value.toLowerCase())};";

/// Outcomes in the order of the page, with the class that colours them.
constexpr std::array<std::pair<const char*, const char*>, 7> kOutcomes{{{"ok", "good"},
                                                                        {"degraded", "warn"},
                                                                        {"failed", "bad"},
                                                                        {"timeout", "bad"},
                                                                        {"memory", "bad"},
                                                                        {"crashed", "bad"},
                                                                        {"cancelled", "warn"}}};

std::string figure(double value, const char* format = "{:.3f}") {
  return std::isfinite(value) ? fmt::format(fmt::runtime(format), value) : "-";
}

/// A cell that sorts as a number.
std::string number_cell(double value, const std::string& shown) {
  return fmt::format("<td data-v=\"{}\">{}</td>", std::isfinite(value) ? fmt::format("{}", value) : "",
                     shown);
}

std::string text_cell(const std::string& text) { return "<td class=\"t\">" + html_text(text) + "</td>"; }

std::string outcome_cell(const AssetRecord& record) {
  const auto found =
      std::ranges::find_if(kOutcomes, [&](const auto& entry) { return record.outcome == entry.first; });
  return fmt::format("<td class=\"t {}\">{}{}</td>", found == kOutcomes.end() ? "bad" : found->second,
                     html_text(record.outcome), record.is_cached ? " (cached)" : "");
}

std::string heads(const std::vector<std::string>& names, std::size_t text_columns) {
  std::string row = "<thead><tr>";
  for (std::size_t i = 0; i < names.size(); ++i)
    row += fmt::format("<th scope=\"col\"{}><button>{}</button></th>", i < text_columns ? " class=\"t\"" : "",
                       html_text(names[i]));
  return row + "</tr></thead>\n";
}

using Ranking = std::vector<const AssetRecord*>;

/// Records with a finite value, the largest first; equal ones in their order.
template <class Value>
Ranking ranked(std::span<const AssetRecord> records, Value value) {
  Ranking ranking;
  for (const AssetRecord& record : records)
    if (std::isfinite(value(record))) ranking.push_back(&record);
  std::ranges::stable_sort(ranking, std::greater<>(), [&](const AssetRecord* r) { return value(*r); });
  return ranking;
}

double depth_error(const AssetRecord& record) {
  return record.has_bundle() ? record.depth_mean_percent : std::nan("");
}
/// What was taken from the cache cost nothing in this run.
double bake_seconds(const AssetRecord& record) { return record.is_cached ? std::nan("") : record.seconds; }

std::string summary(std::span<const AssetRecord> records) {
  std::map<std::string, std::size_t> counts;
  std::size_t cached = 0;
  std::uint64_t bytes = 0;
  double seconds = 0;
  for (const AssetRecord& record : records) {
    ++counts[record.outcome];
    cached += record.is_cached ? 1 : 0;
    if (record.has_bundle()) bytes += record.bytes;
    if (std::isfinite(bake_seconds(record))) seconds += record.seconds;
  }
  std::string table =
      "<table id=\"outcomes\"><thead><tr><th scope=\"col\" class=\"t\">outcome</th>"
      "<th scope=\"col\">assets</th></tr></thead><tbody>\n";
  const auto add = [&](const std::string& outcome, const char* kind) {
    table += fmt::format("<tr><td class=\"t {}\">{}</td><td>{}</td></tr>\n", kind, html_text(outcome),
                         counts[outcome]);
    counts.erase(outcome);
  };
  for (const auto& [outcome, kind] : kOutcomes)
    if (counts.contains(outcome)) add(outcome, kind);
  while (!counts.empty()) add(std::string(counts.begin()->first), "bad");
  return table + fmt::format(
                     "</tbody></table>\n<p>{} assets, {} of them from the cache. {} bytes of bundles. {} "
                     "seconds of baking, summed over assets.</p>\n",
                     records.size(), cached, bytes, figure(seconds, "{:.1f}"));
}

std::string failures(std::span<const AssetRecord> records) {
  std::string rows;
  for (const AssetRecord& record : records) {
    if (record.outcome == "ok" && record.remarks.empty()) continue;
    std::string words = html_text(record.finding);
    for (const std::string& remark : record.remarks)
      words += (words.empty() ? "" : "<br>") + html_text(remark);
    rows += "<tr>" + text_cell(record.input) + outcome_cell(record) + "<td class=\"t\">" + words + "</td>" +
            text_cell(record.remedy) + "</tr>\n";
  }
  if (rows.empty()) return "";
  return "<h2>Failures and remarks</h2>\n<table id=\"failures\">" +
         heads({"asset", "outcome", "what was found", "what to do"}, 4) + "<tbody>\n" + rows +
         "</tbody></table>\n";
}

std::string largest_errors(std::span<const AssetRecord> records) {
  Ranking ranking = ranked(records, depth_error);
  if (ranking.empty()) return "";
  ranking.resize(std::min(ranking.size(), kRanked));
  std::string rows;
  for (const AssetRecord* record : ranking) {
    const double error_mm = record->depth_mean_percent / 100 * record->r_max_m * 1000;
    rows += "<tr>" + text_cell(record->input) +
            number_cell(record->depth_mean_percent, figure(record->depth_mean_percent)) +
            number_cell(error_mm, figure(error_mm, "{:.3g}")) +
            number_cell(record->eq35_percent, figure(record->eq35_percent)) +
            number_cell(record->wrong_percent, figure(record->wrong_percent)) + "</tr>\n";
  }
  return "<h2>Largest errors</h2>\n<p>Mean error of the signed distance within 3 % of the surface, in "
         "percent of "
         "R_max, the largest distance between two vertices; share of points there whose inside or outside is "
         "wrong.</p>\n<table id=\"worst\">" +
         heads({"asset", "depth error %", "depth error mm", "eq. 35 %", "wrong %"}, 1) + "<tbody>\n" + rows +
         "</tbody></table>\n";
}

/// Equal stages have equal colours all over the page.
std::string stage_bar(const AssetRecord& record, double longest_seconds) {
  std::string bar = "<div class=\"bar\">";
  std::size_t index = 0;
  for (const auto& [stage, seconds] : record.stages) {
    if (std::isfinite(seconds) && longest_seconds > 0)
      bar += fmt::format("<i style=\"width:{:.2f}%;background:hsl({} 55% 55%)\" title=\"{} {:.3f} s\"></i>",
                         100 * seconds / longest_seconds, index * 137 % 360, html_text(stage), seconds);
    ++index;
  }
  return bar + "</div>";
}

std::string slowest(std::span<const AssetRecord> records) {
  Ranking ranking = ranked(records, bake_seconds);
  if (ranking.empty()) return "";
  ranking.resize(std::min(ranking.size(), kRanked));
  std::string rows;
  for (const AssetRecord* record : ranking)
    rows += "<tr>" + text_cell(record->input) + outcome_cell(*record) +
            number_cell(record->seconds, figure(record->seconds, "{:.2f}")) +
            number_cell(static_cast<double>(record->faces),
                        record->faces > 0 ? std::to_string(record->faces) : "-") +
            "<td class=\"t\">" + stage_bar(*record, ranking.front()->seconds) + "</td></tr>\n";
  return "<h2>Slowest</h2>\n<table id=\"slowest\">" +
         heads({"asset", "outcome", "seconds", "faces", "stages"}, 2) + "<tbody>\n" + rows +
         "</tbody></table>\n";
}

std::string all_assets(std::span<const AssetRecord> records) {
  std::string rows;
  for (const AssetRecord& record : records) {
    const auto count_cell = [&](std::uint64_t count) {
      return record.has_bundle() ? number_cell(static_cast<double>(count), std::to_string(count))
                                 : number_cell(std::nan(""), "-");
    };
    rows += "<tr>" + text_cell(record.input) + outcome_cell(record) + count_cell(record.parts) +
            count_cell(record.bytes) + number_cell(depth_error(record), figure(depth_error(record))) +
            number_cell(record.eq35_percent, figure(record.eq35_percent)) +
            number_cell(record.wrong_percent, figure(record.wrong_percent)) +
            number_cell(record.seconds, figure(record.seconds, "{:.2f}")) + "</tr>\n";
  }
  return "<h2>All assets</h2>\n<p><label>Show only rows with <input id=\"filter\" "
         "type=\"search\"></label></p>\n"
         "<table id=\"all\">" +
         heads({"asset", "outcome", "parts", "bytes", "depth error %", "eq. 35 %", "wrong %", "seconds"}, 2) +
         "<tbody>\n" + rows + "</tbody></table>\n";
}

/// Those to draw: worst first, then slowest, then the others.
Ranking drawn_first(std::span<const AssetRecord> records) {
  Ranking order;
  const auto append = [&](const Ranking& ranking, std::size_t count) {
    for (std::size_t i = 0; i < std::min(count, ranking.size()); ++i)
      if (std::ranges::find(order, ranking[i]) == order.end()) order.push_back(ranking[i]);
  };
  append(ranked(records, depth_error), kRanked);
  append(ranked(records, bake_seconds), kRanked);
  const std::size_t ranked_count = order.size();
  for (const AssetRecord& record : records)
    if (std::find(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(ranked_count), &record) ==
        order.begin() + static_cast<std::ptrdiff_t>(ranked_count))
      order.push_back(&record);
  return order;
}

std::string gallery(std::span<const AssetRecord> records, std::size_t most) {
  std::string figures;
  std::size_t drawn = 0;
  for (const AssetRecord* record : drawn_first(records)) {
    if (drawn == most) break;
    if (!record->has_bundle()) continue;
    const Result<Asset> asset = io::read(record->output);
    if (!asset) continue;
    const Result<std::vector<std::uint8_t>> png = part_picture(asset.value(), kPictureSide);
    if (!png) continue;
    ++drawn;
    const std::size_t parts = asset.value().parts.size();
    figures += fmt::format(
        "<figure><img width=\"{}\" height=\"{}\" alt=\"{} superquadrics of {}, and the surface their maps "
        "hold\" "
        "src=\"data:image/png;base64,{}\"><figcaption>{}: {}, depth error {} %</figcaption></figure>\n",
        2 * kPictureSide, kPictureSide, parts, html_text(record->input), base64(png.value()),
        html_text(record->input), parts == 1 ? "1 part" : fmt::format("{} parts", parts),
        figure(depth_error(*record)));
  }
  if (drawn == 0) return "";
  return fmt::format(
             "<h2>Parts</h2>\n<p>Left the superquadrics, right the surface that their maps hold, each part "
             "in "
             "its colour. {} of {} assets are drawn.</p>\n<div class=\"gallery\">\n",
             drawn, records.size()) +
         figures + "</div>\n";
}

}  // namespace

std::string report_page(std::span<const AssetRecord> records, const ReportOptions& options) {
  return "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\n"
         "<meta name=\"viewport\" content=\"width=device-width\">\n" +
         std::string(kPageMark) + "\n<title>" + html_text(options.title) + "</title>\n<style>" + kStyle +
         "</style></head>\n<body>\n<h1>" + html_text(options.title) + "</h1>\n" + summary(records) +
         failures(records) + largest_errors(records) + slowest(records) +
         gallery(records, options.picture_count) + all_assets(records) + "<script>" + kScript +
         "</script>\n</body></html>\n";
}

}  // namespace sqmap::apps

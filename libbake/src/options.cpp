// SPDX-License-Identifier: GPL-3.0-or-later
#include <string>

#include <nlohmann/json.hpp>

#include "sqmap/bake/bake.hpp"

namespace sqmap::bake {

namespace {

Error bad(const char* name, double value, const char* required) {
  return {Status::kBadOption,
          std::string(name) + " = " + nlohmann::json(value).dump() + ", must be " + required, ""};
}

}  // namespace

Outcome BakeOptions::check() const {
  if (!(max_error_percent > 0 && max_error_percent <= 100)) {
    return bad("max_error_percent", max_error_percent, "in (0, 100]");
  }
  if (!(max_error_m >= 0 && max_error_m < 1e15)) return bad("max_error_m", max_error_m, "in [0, 1e15)");
  if (max_parts < 1 || max_parts > kMaxParts) return bad("max_parts", max_parts, "in [1, 4096]");
  if (max_bytes < 4096) return bad("max_bytes", static_cast<double>(max_bytes), ">= 4096");
  if (sample_count < 100 || sample_count > 10000000)
    return bad("sample_count", sample_count, "in [100, 10000000]");
  if (!(read.metres_per_unit > 0 && read.metres_per_unit < 1e12)) {
    return bad("read.metres_per_unit", read.metres_per_unit, "in (0, 1e12)");
  }
  if (!(repair.weld_tolerance >= 0 && repair.weld_tolerance < 0.1)) {
    return bad("repair.weld_tolerance", repair.weld_tolerance, "in [0, 0.1)");
  }
  if (conservative && fit.bend)
    return Error{Status::kBadOption,
                 "bounds of the surface are for straight superquadrics, not for bent ones",
                 "bake conservatively, or with bends"};
  if (auto outcome = decompose.check(); !outcome) return outcome;
  return fit.check();
}

void BakeOptions::set(Quality quality) {
  struct Limits {
    double error_percent;
    std::uint32_t parts;
    std::uint64_t kilobytes;
  };
  const Limits limits = quality == Quality::kDraft  ? Limits{0.2, 12, 64}
                        : quality == Quality::kFine ? Limits{0.025, 48, 256}
                                                    : Limits{0.05, 24, 128};
  max_error_percent = limits.error_percent;
  max_error_m = 0;
  max_parts = limits.parts;
  max_bytes = limits.kilobytes * 1024;
}

// Each structure is taken apart by name, so that a new option that is not written here does not compile.
std::string BakeOptions::to_json() const {
  static constexpr const char* kRepairNames[] = {"none", "safe", "all"};
  static constexpr const char* kAxisNames[] = {"x", "y", "z"};
  const auto& [read_options, repair_options, decompose_options, fit_options, error_percent, error_m, parts,
               bytes, samples, sample_seed, with_bounds] = *this;
  const auto& [metres_per_unit, up, size_limit] = read_options;  // the limit decides no byte
  const auto& [policy, weld_tolerance, max_hole_edges] = repair_options;
  const auto& [source_count, window, locale_width, boundary_strength, min_hull_gain, k_h, t_h,
               use_boundary_strength, use_hyperbolic, join_components, min_part_area] = decompose_options;
  const auto& [min_exponent, max_exponent, max_iterations, min_axis_ratio, quick, taper, bend] = fit_options;
  nlohmann::json json = {
      {"max_error_percent", error_percent},
      {"max_error_m", error_m},
      {"max_parts", parts},
      {"max_bytes", bytes},
      {"sample_count", samples},
      {"seed", sample_seed},
      {"read", {{"metres_per_unit", metres_per_unit}, {"up", kAxisNames[static_cast<int>(up)]}}},
      {"repair",
       {{"policy", kRepairNames[static_cast<int>(policy)]},
        {"weld_tolerance", weld_tolerance},
        {"max_hole_edges", max_hole_edges}}},
      {"decompose",
       {{"source_count", source_count},
        {"window", window},
        {"locale_width", locale_width},
        {"boundary_strength", boundary_strength},
        {"min_hull_gain", min_hull_gain},
        {"k_h", k_h},
        {"t_h", t_h},
        {"use_boundary_strength", use_boundary_strength},
        {"use_hyperbolic", use_hyperbolic},
        {"join_components", join_components},
        {"min_part_area", min_part_area}}},
      {"fit",
       {{"min_exponent", min_exponent},
        {"max_exponent", max_exponent},
        {"max_iterations", max_iterations},
        {"min_axis_ratio", min_axis_ratio},
        {"quick", quick}}},
  };
  // Named where they decide bytes.
  if (taper) json["fit"]["taper"] = true;
  if (bend) json["fit"]["bend"] = true;
  if (with_bounds) json["conservative"] = true;
  return json.dump();
}

}  // namespace sqmap::bake

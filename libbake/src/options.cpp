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
  if (auto outcome = decompose.check(); !outcome) return outcome;
  return fit.check();
}

std::string BakeOptions::to_json() const {
  static constexpr const char* kRepairNames[] = {"none", "safe", "all"};
  static constexpr const char* kAxisNames[] = {"x", "y", "z"};
  const nlohmann::json json = {
      {"max_error_percent", max_error_percent},
      {"max_parts", max_parts},
      {"max_bytes", max_bytes},
      {"sample_count", sample_count},
      {"seed", seed},
      {"read", {{"metres_per_unit", read.metres_per_unit}, {"up", kAxisNames[static_cast<int>(read.up)]}}},
      {"repair",
       {{"policy", kRepairNames[static_cast<int>(repair.policy)]},
        {"weld_tolerance", repair.weld_tolerance},
        {"max_hole_edges", repair.max_hole_edges}}},
      {"fit",
       {{"min_exponent", fit.min_exponent},
        {"max_exponent", fit.max_exponent},
        {"max_iterations", fit.max_iterations},
        {"min_axis_ratio", fit.min_axis_ratio}}},
  };
  return json.dump();
}

}  // namespace sqmap::bake

// SPDX-License-Identifier: Apache-2.0
#include "sqmap/asset/validate.hpp"

#include <cstdio>
#include <fstream>
#include <functional>
#include <limits>
#include <set>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "support/asset_builder.hpp"

namespace sqmap {
namespace {

using test::bent_asset;

const double kNan = std::numeric_limits<double>::quiet_NaN();
const double kInfinity = std::numeric_limits<double>::infinity();

struct Breakage {
  int rule;
  const char* what;
  std::function<void(Asset&)> apply;
};

// One or more ways to break each rule of FORMAT.md section 8, each a single change to a valid asset.
const std::vector<Breakage>& breakages() {
  static const std::vector<Breakage> all{
      {1, "no part", [](Asset& a) { a.parts.clear(); }},
      {1, "one part too many", [](Asset& a) { a.parts.resize(kMaxParts + 1, a.parts[2]); }},
      {2, "r_max zero", [](Asset& a) { a.r_max_m = 0; }},
      {2, "r_max NaN", [](Asset& a) { a.r_max_m = kNan; }},
      {3, "sphere radius NaN", [](Asset& a) { a.sphere.radius_m = kNan; }},
      {3, "sphere centre infinite", [](Asset& a) { a.sphere.centre_m.y = -kInfinity; }},
      {4, "NUL in a text", [](Asset& a) { a.provenance.generator.push_back('\0'); }},
      {4, "Latin-1", [](Asset& a) { a.provenance.source_name = "h\xE4nd.off"; }},
      {4, "overlong UTF-8", [](Asset& a) { a.provenance.source_name = "\xC0\xAF"; }},
      {4, "overlong UTF-8 of three bytes", [](Asset& a) { a.provenance.source_name = "\xE0\x80\xAF"; }},
      {4, "UTF-16 surrogate", [](Asset& a) { a.provenance.source_name = "\xED\xA0\x80"; }},
      {4, "beyond Unicode", [](Asset& a) { a.provenance.source_name = "\xF4\x90\x80\x80"; }},
      {4, "cut UTF-8", [](Asset& a) { a.provenance.source_name = "\xF0\x9F\x98"; }},
      {4, "long options", [](Asset& a) { a.provenance.options_json.assign(32769, ' '); }},
      {5, "short hash", [](Asset& a) { a.provenance.source_hash = "0123"; }},
      {5, "upper-case hash", [](Asset& a) { a.provenance.source_hash[20] = 'A'; }},
      {6, "unit of length zero", [](Asset& a) { a.provenance.metres_per_unit = 0; }},
      {6, "unit of length infinite", [](Asset& a) { a.provenance.metres_per_unit = kInfinity; }},
      {7, "unknown axis", [](Asset& a) { a.provenance.up_axis = "w"; }},
      {8, "mesh volume NaN", [](Asset& a) { a.mesh.volume_m3 = kNan; }},
      {9, "label of no part", [](Asset& a) { a.face_labels[4] = 3; }},
      {10, "layer 0", [](Asset& a) { a.errors[0].layer = 0; }},
      {10, "layer 4", [](Asset& a) { a.errors[2].layer = 4; }},
      {10, "level of no part", [](Asset& a) { a.errors[2].level = 3; }},
      {11, "negative error", [](Asset& a) { a.errors[1].depth_mean_percent = -0.1; }},
      {11, "infinite error", [](Asset& a) { a.errors[1].misclassified_05_percent = kInfinity; }},
      {20, "semi-axis zero", [](Asset& a) { a.parts[1].shape.semi_axes_m.y = 0; }},
      {20, "semi-axis NaN", [](Asset& a) { a.parts[1].shape.semi_axes_m.x = kNan; }},
      {20, "semi-axis infinite", [](Asset& a) { a.parts[1].shape.semi_axes_m.z = kInfinity; }},
      {21, "e1 too small", [](Asset& a) { a.parts[0].shape.e1 = 0.0999; }},
      {21, "e2 too large", [](Asset& a) { a.parts[0].shape.e2 = 2.0001; }},
      {21, "e2 NaN", [](Asset& a) { a.parts[0].shape.e2 = kNan; }},
      {22, "orientation zero",
       [](Asset& a) {
         a.parts[0].object_from_part.orientation = {0, 0, 0, 0};
       }},
      {22, "orientation scaled", [](Asset& a) { a.parts[1].object_from_part.orientation.w *= 1.001; }},
      {22, "orientation NaN", [](Asset& a) { a.parts[1].object_from_part.orientation.z = kNan; }},
      {23, "translation infinite", [](Asset& a) { a.parts[2].object_from_part.translation_m.x = kInfinity; }},
      {24, "part sphere of radius zero", [](Asset& a) { a.parts[2].sphere.radius_m = 0; }},
      {24, "part sphere NaN", [](Asset& a) { a.parts[2].sphere.centre_m.z = kNan; }},
      {25, "segment out of range", [](Asset& a) { a.parts[0].segment = kMaxParts; }},
      {26, "unknown reason", [](Asset& a) { a.parts[0].reason = static_cast<CutReason>(5); }},
      {27, "part volume infinite", [](Asset& a) { a.parts[1].volume_m3 = kInfinity; }},
      {28, "asset sphere of no size", [](Asset& a) { a.sphere.radius_m = 1e-305; }},
      {28, "semi-axis longer than the asset", [](Asset& a) { a.parts[1].shape.semi_axes_m.z = 3.1; }},
      {28, "part outside of the asset", [](Asset& a) { a.parts[2].object_from_part.translation_m.x = -2.9; }},
      {29, "taper too large", [](Asset& a) { a.parts[0].shape.taper = -1.0001 * max_taper(0.8); }},
      {29, "taper of an octahedron",
       [](Asset& a) {
         a.parts[0].shape = {{0.3, 0.4, 0.6}, 2, 1, 0.01};
       }},
      {29, "taper NaN", [](Asset& a) { a.parts[1].shape.taper = kNan; }},
      {40, "bend by more than 2 rad",
       [](Asset& a) {
         a.parts[2].shape.bend = {0, 4.01};
       }},
      {40, "bend of next to nothing",
       [](Asset& a) {
         a.parts[2].shape.bend = {1e-9, 0};
       }},
      {40, "bend tighter than the part is thick",
       [](Asset& a) {
         a.parts[2].shape.bend = {0, 0.95};
       }},
      {40, "bend NaN", [](Asset& a) { a.parts[2].shape.bend.x = kNan; }},
      {40, "bend beside bounds",
       [](Asset& a) {
         a.parts[0].shape.bend = {0.1, 0};
       }},
      {30, "no level", [](Asset& a) { a.parts[1].map.level_count = 0; }},
      {30, "too many levels", [](Asset& a) { a.parts[1].map.level_count = 40; }},
      {31, "even rows", [](Asset& a) { a.parts[1].map.rows = 8; }},
      {31, "rows zero", [](Asset& a) { a.parts[1].map.rows = 0; }},
      {31, "rows one", [](Asset& a) { a.parts[1].map.rows = 1; }},
      {31, "rows without the pyramid", [](Asset& a) { a.parts[0].map.level_count = 5; }},
      {31, "too many rows", [](Asset& a) { a.parts[1].map.rows = 4099; }},
      {32, "odd columns", [](Asset& a) { a.parts[1].map.cols = 13; }},
      {32, "columns zero", [](Asset& a) { a.parts[1].map.cols = 0; }},
      {32, "columns without the pyramid", [](Asset& a) { a.parts[1].map.level_count = 3; }},
      {32, "too many columns", [](Asset& a) { a.parts[1].map.cols = 8196; }},
      {33, "3 bits", [](Asset& a) { a.parts[1].map.bits = 3; }},
      {33, "17 bits", [](Asset& a) { a.parts[1].map.bits = 17; }},
      {34, "negative depth", [](Asset& a) { a.parts[1].map.depth_min_m = -1e-9; }},
      {34, "step NaN", [](Asset& a) { a.parts[1].map.depth_step_m = kNan; }},
      {34, "depth overflows", [](Asset& a) { a.parts[1].map.depth_step_m = 1e13; }},
      {35, "a code missing", [](Asset& a) { a.parts[0].map.code.pop_back(); }},
      {35, "no codes", [](Asset& a) { a.parts[0].map.code.clear(); }},
      {36, "seam bits cut", [](Asset& a) { a.parts[1].map.start_inside.pop_back(); }},
      {37, "crossing beyond the map", [](Asset& a) { a.parts[1].map.crossings[3].texel = 108; }},
      {37, "crossings out of order", [](Asset& a) { a.parts[1].map.crossings[1].code = 179; }},
      {37, "crossing twice", [](Asset& a) { a.parts[1].map.crossings[1].code = 180; }},
      {38, "sample in the last row", [](Asset& a) { a.parts[1].map.vertex_samples[2].cell = 96; }},
      {38, "two samples of a cell", [](Asset& a) { a.parts[1].map.vertex_samples[1].cell = 0; }},
      {39, "more cells than the format has",
       [](Asset& a) {
         a.parts[0].bounds.cells = 65;
         a.parts[0].bounds.cell.resize(std::size_t{6} * 65 * 65);
       }},
      {39, "a bound missing", [](Asset& a) { a.parts[1].bounds.cell.pop_back(); }},
      {39, "bounds of no cell", [](Asset& a) { a.parts[1].bounds.cells = 0; }},
      {39, "negative tolerance", [](Asset& a) { a.parts[0].bounds.tolerance_m = -1e-9; }},
      {39, "tolerance NaN", [](Asset& a) { a.parts[0].bounds.tolerance_m = kNan; }},
      {50, "labels missing", [](Asset& a) { a.face_labels.pop_back(); }},
      {51, "code too large", [](Asset& a) { a.parts[0].map.code[3] = 1024; }},
      {52, "seam bits of no texel", [](Asset& a) { a.parts[1].map.start_inside[13] |= 0b10000; }},
      {53, "crossing at the first", [](Asset& a) { a.parts[1].map.crossings[2].code = 17; }},
      {53, "crossing is a miss", [](Asset& a) { a.parts[1].map.crossings[3].code = 255; }},
      {53, "crossing after a miss", [](Asset& a) { a.parts[1].map.code[40] = 255; }},
      {54, "sample is a miss", [](Asset& a) { a.parts[1].map.vertex_samples[0].code = 255; }},
      {55, "part sphere too small", [](Asset& a) { a.parts[0].sphere.radius_m = 0.6; }},
      {55, "part sphere elsewhere", [](Asset& a) { a.parts[2].sphere.centre_m.x = 0.4; }},
      {56, "asset sphere too small", [](Asset& a) { a.sphere.radius_m = 1; }},
      {57, "free ranges that overlap", [](Asset& a) { a.parts[0].bounds.cell[3].upper = 204; }},
      {57, "a side that is none", [](Asset& a) { a.parts[1].bounds.cell[9].sides = 4; }},
  };
  return all;
}

std::set<int> rules_of(const std::vector<Finding>& findings) {
  std::set<int> rules;
  for (const Finding& finding : findings) rules.insert(finding.rule);
  return rules;
}

TEST(Validate, RichAssetBreaksNoRule) {
  const auto findings = validate(bent_asset(), CheckLevel::kFull);
  EXPECT_TRUE(findings.empty()) << findings.front().rule << ": " << findings.front().message;
}

TEST(Validate, FindsEachBrokenRuleUnderItsNumber) {
  for (const Breakage& breakage : breakages()) {
    Asset asset = bent_asset();
    breakage.apply(asset);
    EXPECT_TRUE(rules_of(validate(asset, CheckLevel::kFull)).contains(breakage.rule))
        << breakage.what << " is not found as rule " << breakage.rule;
  }
}

// The table of FORMAT.md section 8 and the breakages above name the same rules.
TEST(Validate, FormatPageListsExactlyTheseRules) {
  std::set<int> documented, broken;
  std::ifstream page(SQMAP_FORMAT_PAGE);
  bool in_rules = false;
  for (std::string line; std::getline(page, line);) {
    if (line.rfind("## ", 0) == 0) in_rules = line == "## 8 Rules";
    int rule = 0;
    if (in_rules && std::sscanf(line.c_str(), "| %d |", &rule) == 1) documented.insert(rule);
  }
  for (const Breakage& breakage : breakages()) broken.insert(breakage.rule);
  EXPECT_EQ(documented, broken);
}

TEST(Validate, QuickFindsWhatAReaderMustTrust) {
  for (const Breakage& breakage : breakages()) {
    Asset asset = bent_asset();
    breakage.apply(asset);
    EXPECT_EQ(rules_of(validate(asset, CheckLevel::kQuick)).contains(breakage.rule), breakage.rule < 50)
        << breakage.what;
  }
}

TEST(Validate, NamesThePartAndTheValue) {
  Asset asset = bent_asset();
  asset.parts[1].shape.e1 = 7.25;
  const auto findings = validate(asset, CheckLevel::kQuick);
  ASSERT_EQ(findings.size(), 1u);
  EXPECT_NE(findings[0].message.find("part 1"), std::string::npos) << findings[0].message;
  EXPECT_NE(findings[0].message.find("7.25"), std::string::npos) << findings[0].message;
}

TEST(Validate, OrdersFindingsByRuleAndPart) {
  Asset asset = bent_asset();
  asset.parts[2].shape.e1 = asset.parts[0].shape.e1 = 3;
  asset.parts[1].shape.semi_axes_m.x = -1;
  asset.r_max_m = -1;
  const auto findings = validate(asset, CheckLevel::kQuick);
  ASSERT_EQ(findings.size(), 4u);
  EXPECT_EQ(findings[0].rule, 2);
  EXPECT_EQ(findings[1].rule, 20);
  EXPECT_EQ(findings[2].message.rfind("part 0", 0), 0u);
  EXPECT_EQ(findings[3].message.rfind("part 2", 0), 0u);
}

TEST(Validate, IsTotalForAnythingBrokenTogether) {
  Asset asset = bent_asset();
  std::set<int> rules;
  for (const Breakage& breakage : breakages()) {
    breakage.apply(asset);
    if (asset.parts.size() != 3) asset.parts = bent_asset().parts;
    for (const Finding& finding : validate(asset, CheckLevel::kFull)) rules.insert(finding.rule);
  }
  EXPECT_GT(rules.size(), 20u);
  EXPECT_FALSE(validate(Asset{}, CheckLevel::kFull).empty());
}

TEST(Validate, AcceptsTheLimitsThemselves) {
  Asset asset = bent_asset();
  asset.parts[2].shape.e1 = kMinExponent;
  asset.parts[2].shape.e2 = kMaxExponent;
  asset.provenance.generator.assign(4096, 'x');
  asset.provenance.source_hash.clear();
  asset.provenance.source_name =
      "\xF0\x9F\x90\x98 \xED\x9F\xBF";  // beyond the 16-bit plane; last before surrogates
  asset.face_labels.clear();
  asset.parts[0].map.depth_step_m = 0;
  EXPECT_TRUE(validate(asset, CheckLevel::kFull).empty());
}

}  // namespace
}  // namespace sqmap

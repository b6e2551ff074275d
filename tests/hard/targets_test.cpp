// SPDX-License-Identifier: Apache-2.0
// The instruction sets that the other tests ask are all that the processor has.
#include "support/targets.hpp"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>
#include <span>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "sqmap/runtime/object.hpp"

namespace sqmap::runtime {
namespace {

/// What Linux says that the first processor has; empty elsewhere.
std::vector<std::string> processor_flags() {
  std::ifstream file("/proc/cpuinfo");
  for (std::string line; std::getline(file, line);) {
    if (line.rfind("flags", 0) != 0) continue;
    std::istringstream words(line.substr(line.find(':') + 1));
    return {std::istream_iterator<std::string>(words), {}};
  }
  return {};
}

TEST(Targets, AreThoseOfTheProcessor) {
  const std::vector<std::string> flags = processor_flags();
  if (flags.empty()) GTEST_SKIP() << "no flags in /proc/cpuinfo";
  const auto has_all = [&](const std::vector<std::string>& names) {
    return std::ranges::all_of(
        names, [&](const std::string& name) { return std::ranges::find(flags, name) != flags.end(); });
  };
  const bool has_sse4 = has_all({"ssse3", "sse4_2"});
  const bool has_avx2 = has_sse4 && has_all({"avx2", "fma", "bmi1", "bmi2"});
  const bool has_avx512 = has_avx2 && has_all({"avx512f", "avx512vl", "avx512bw", "avx512dq", "avx512cd"});
  std::vector<SimdTarget> asked;
  const int count = test::for_each_target([&](SimdTarget target) {
    EXPECT_EQ(simd_target(), target);
    asked.push_back(target);
  });
  std::vector<SimdTarget> expected{SimdTarget::kBaseline};
  if (has_sse4) expected.push_back(SimdTarget::kSse4);
  if (has_avx2) expected.push_back(SimdTarget::kAvx2);
  if (has_avx512) expected.push_back(SimdTarget::kAvx512);
  EXPECT_EQ(asked, expected);
  EXPECT_EQ(count, static_cast<int>(expected.size()));
  EXPECT_EQ(simd_target(), expected.back()) << "the widest is in use";
}

/// Answers 1 m everywhere, but for one instruction set the distance of one point in a batch.
struct Liar {
  SimdTarget target;
  float distance_m;
  Answer query(const Vec3f& /*p*/, const QueryOptions& /*options*/) const {
    Answer answer;
    answer.signed_distance_m = 1;
    return answer;
  }
  void query(std::span<const Vec3f> points, const Answers& answers, const QueryOptions& /*options*/) const {
    for (std::size_t i = 0; i < points.size(); ++i) {
      answers.signed_distance_m[i] = 1;
      answers.part[i] = kNowhere;
    }
    if (simd_target() == target) answers.signed_distance_m.back() = distance_m;
  }
};

// The widest instruction set is the one that other tests use anyway; the first is the one they would miss.
TEST(Targets, DoNotAgreeWhereOneBitOfOneAnswerIsOther) {
  const std::vector<Vec3f> points(20);
  EXPECT_TRUE(test::every_target_agrees(Liar{SimdTarget::kBaseline, 1}, points, {}));
  for (const SimdTarget target : {SimdTarget::kBaseline, simd_target()})
    for (const float other : {std::nextafter(1.0F, 2.0F), std::nanf("")})
      EXPECT_FALSE(test::every_target_agrees(Liar{target, other}, points, {}));
}

}  // namespace
}  // namespace sqmap::runtime

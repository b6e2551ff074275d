// SPDX-License-Identifier: Apache-2.0
#include "sqmap/asset/miss_run.hpp"

#include <string>

#include <gtest/gtest.h>

namespace sqmap {
namespace {

/// '.' misses, 'i' inner misses, '#' hits.
MissRun run_of(const std::string& row) {
  return longest_miss_run(static_cast<std::uint32_t>(row.size()), [&](std::uint32_t col) {
    return row[col] == '#' ? RayKind::kHit : row[col] == 'i' ? RayKind::kInnerMiss : RayKind::kMiss;
  });
}

TEST(MissRun, IsTheLongestOfOneKindRoundTheTurn) {
  struct Case {
    const char* row;
    std::uint32_t end, count;
    RayKind kind;
  };
  for (const auto& [row, end, count, kind] : {Case{"#..###...", 0, 3, RayKind::kMiss},
                                              {"..#...#.", 6, 3, RayKind::kMiss},
                                              {"...#.#..", 3, 5, RayKind::kMiss},
                                              {"iii#.ii.", 3, 3, RayKind::kInnerMiss},
                                              {"i.##.iii", 1, 4, RayKind::kInnerMiss},
                                              {"........", 0, 8, RayKind::kMiss},
                                              {"i.......", 0, 7, RayKind::kMiss},
                                              {".iiiiiii", 0, 7, RayKind::kInnerMiss}}) {
    const MissRun run = run_of(row);
    EXPECT_EQ(run.end, end) << row;
    EXPECT_EQ(run.count, count) << row;
    EXPECT_EQ(run.kind, kind) << row;
  }
  EXPECT_EQ(run_of("########").count, 0U);
}

}  // namespace
}  // namespace sqmap

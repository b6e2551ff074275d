// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <cstdlib>
#include <map>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "../../apps/sqbake/plan/costs.hpp"
#include "../../apps/sqbake/plan/merge.hpp"
#include "../../apps/sqbake/plan/shards.hpp"

namespace sqmap::apps {
namespace {

std::vector<WorkItem> random_items(std::mt19937_64& random, std::size_t count) {
  std::vector<WorkItem> items;
  for (std::size_t k = 0; k < count; ++k)
    items.push_back({"mesh " + std::to_string(k), random() % 8'000'000});
  return items;
}

std::uint64_t heaviest(const std::vector<WorkItem>& items, const std::vector<std::uint32_t>& shard_of) {
  std::map<std::uint32_t, std::uint64_t> load;
  for (std::size_t k = 0; k < items.size(); ++k) load[shard_of[k]] += items[k].cost;
  return std::ranges::max_element(load, {}, [](const auto& entry) { return entry.second; })->second;
}

TEST(Shards, AreWithinGrahamsBoundOfTheBestOfAllDeals) {
  constexpr std::uint32_t kShards = 3;
  std::mt19937_64 random(1);
  int better_than_in_turn = 0;
  for (int draw = 0; draw < 30; ++draw) {
    const std::vector<WorkItem> items = random_items(random, 8);
    std::uint64_t best = ~std::uint64_t{0};
    for (std::uint32_t deal = 0; deal < 6561; ++deal) {  // 3^8
      std::vector<std::uint32_t> shard_of;
      for (std::uint32_t rest = deal; shard_of.size() < items.size(); rest /= kShards)
        shard_of.push_back(rest % kShards);
      best = std::min(best, heaviest(items, shard_of));
    }
    const std::uint64_t ours = heaviest(items, deal_out(items, kShards));
    EXPECT_LE(static_cast<double>(ours), (4.0 / 3 - 1.0 / (3 * kShards)) * static_cast<double>(best));
    better_than_in_turn += ours < heaviest(items, {0, 1, 2, 0, 1, 2, 0, 1}) ? 1 : 0;
  }
  EXPECT_GT(better_than_in_turn, 20);
}

TEST(Shards, DependOnNamesAndCostsNotOnTheOrder) {
  std::mt19937_64 random(2);
  std::vector<WorkItem> items = random_items(random, 200);
  for (std::size_t k = 0; k < 50; ++k) items[k].cost = 1000;  // ties
  std::map<std::string, std::uint32_t> first;
  const std::vector<std::uint32_t> shard_of = deal_out(items, 7);
  for (std::size_t k = 0; k < items.size(); ++k) first[items[k].name] = shard_of[k];
  std::ranges::shuffle(items, random);
  const std::vector<std::uint32_t> again = deal_out(items, 7);
  for (std::size_t k = 0; k < items.size(); ++k) EXPECT_EQ(again[k], first[items[k].name]);
}

TEST(Shards, AreAllUsedAndNoMoreThanThose) {
  std::mt19937_64 random(3);
  const std::vector<std::uint32_t> many = deal_out(random_items(random, 40), 9);
  for (std::uint32_t shard = 0; shard < 9; ++shard) EXPECT_GT(std::ranges::count(many, shard), 0);
  EXPECT_LT(std::ranges::max(many), 9U);
  std::vector<std::uint32_t> few = deal_out(random_items(random, 3), 9);
  std::ranges::sort(few);
  EXPECT_EQ(few, (std::vector<std::uint32_t>{0, 1, 2}));
  EXPECT_TRUE(deal_out({}, 4).empty());
}

TEST(ShardNames, AreCountedFromOne) {
  const Result<Shard> shard = parse_shard("2/8");
  ASSERT_TRUE(shard);
  EXPECT_EQ(shard.value().index, 1U);
  EXPECT_EQ(shard.value().count, 8U);
  for (const char* text :
       {"", "/", "0/4", "5/4", "1/0", "1", "a/b", "1/2/3", "-1/4", "1/4 ", "1/99999999999"}) {
    const Result<Shard> wrong = parse_shard(text);
    ASSERT_FALSE(wrong) << text;
    EXPECT_EQ(wrong.error().status, Status::kBadOption);
  }
}

class JobArray : public testing::Test {
 protected:
  ~JobArray() override { clear(); }
  static void clear() {
    for (const char* name : {"SLURM_ARRAY_TASK_ID", "SLURM_ARRAY_TASK_COUNT", "SLURM_ARRAY_TASK_MIN",
                             "SLURM_ARRAY_TASK_STEP", "JOB_COMPLETION_INDEX", "JOB_COMPLETIONS"})
      ::unsetenv(name);
  }
  static void set(const std::map<std::string, std::string>& variables) {
    clear();
    for (const auto& [name, value] : variables) ::setenv(name.c_str(), value.c_str(), 1);
  }
};

TEST_F(JobArray, EveryTaskOfAnArrayGetsAShardOfItsOwn) {
  std::vector<std::uint32_t> indices;
  for (int id = 3; id <= 17; id += 7) {  // --array=3-17:7
    set({{"SLURM_ARRAY_TASK_ID", std::to_string(id)},
         {"SLURM_ARRAY_TASK_COUNT", "3"},
         {"SLURM_ARRAY_TASK_MIN", "3"},
         {"SLURM_ARRAY_TASK_STEP", "7"}});
    const Result<Shard> shard = parse_shard("auto");
    ASSERT_TRUE(shard);
    EXPECT_EQ(shard.value().count, 3U);
    indices.push_back(shard.value().index);
  }
  EXPECT_EQ(indices, (std::vector<std::uint32_t>{0, 1, 2}));
  set({{"JOB_COMPLETION_INDEX", "4"}, {"JOB_COMPLETIONS", "5"}});
  const Result<Shard> shard = parse_shard("auto");
  ASSERT_TRUE(shard);
  EXPECT_EQ(shard.value().index, 4U);
}

TEST_F(JobArray, OutsideOfOneNothingIsGuessed) {
  clear();
  EXPECT_FALSE(parse_shard("auto"));
  set({{"SLURM_ARRAY_TASK_ID", "9"}, {"SLURM_ARRAY_TASK_COUNT", "3"}, {"SLURM_ARRAY_TASK_MIN", "1"}});
  EXPECT_FALSE(parse_shard("auto")) << "an array with gaps: --array=1,5,9";
  EXPECT_FALSE(shard_of_job_array()) << "must not pass for a process outside of any";
  set({{"JOB_COMPLETION_INDEX", "5"}, {"JOB_COMPLETIONS", "5"}});
  EXPECT_FALSE(parse_shard("auto"));
  EXPECT_FALSE(shard_of_job_array());
  clear();
  ASSERT_TRUE(shard_of_job_array());
  EXPECT_FALSE(shard_of_job_array().value());
}

AssetRecord record(const std::string& output, const std::string& outcome, const std::string& more = "") {
  const std::string line = R"({"schema":"sqmap.bake/3","type":"asset","input":"m","output":")" + output +
                           R"(","outcome":")" + outcome + "\"" + more + "}\n";
  const Result<AssetRecords> parsed = parse_asset_records(line, "test");
  EXPECT_TRUE(parsed);
  return parsed.value().records.front();
}

TEST(Costs, AreTheTimesOfAnEarlierBakeWhereThereAreAny) {
  const std::vector<InputFile> inputs{{"a", 10}, {"b", 5'000'000}, {"c", 70'000}, {"d", 2'000'000}};
  const std::vector<std::uint64_t> costs =
      expected_costs(inputs, {{"a", 30}, {"b", 10}, {"c", 20}, {"x", 1}});
  EXPECT_NEAR(static_cast<double>(costs[0]), 3 * static_cast<double>(costs[1]), 3);
  EXPECT_NEAR(static_cast<double>(costs[2]), 2 * static_cast<double>(costs[1]), 3);
  const std::vector<std::uint64_t> by_size = expected_costs(inputs, {{"x", 1}});
  EXPECT_EQ(costs[3], by_size[3]) << "no time of d";
  EXPECT_EQ(costs[2], by_size[2]) << "the median of the ratios is that of c, so the unit is that of sizes";
  EXPECT_GT(by_size[1], by_size[0]);
}

TEST(Costs, OnlyBakesThatRanTell) {
  const std::vector<AssetRecord> records{record("a", "ok", R"(,"seconds":5.0,"cached":false)"),
                                         record("a", "timeout", R"(,"seconds":9.0,"cached":false)"),
                                         record("a", "ok", R"(,"seconds":0.01,"cached":true)"),
                                         record("a", "cancelled", R"(,"seconds":0.0,"cached":false)"),
                                         record("a", "ok")};
  EXPECT_EQ(bake_times(records), (BakeTimes{{"m", 9.0}}));
}

// Times as heavy-tailed as those of real meshes, which have little to do with the sizes.
TEST(Costs, TimesBalanceShardsThatSizesDoNot) {
  std::mt19937_64 random(4);
  std::lognormal_distribution<double> seconds(0, 1);
  for (const std::uint32_t shard_count : {2U, 8U, 16U}) {
    std::vector<InputFile> inputs;
    BakeTimes times;
    double sum_s = 0;
    for (int k = 0; k < 200; ++k) {
      inputs.push_back({"mesh " + std::to_string(k), random() % 1'000'000});
      sum_s += times[inputs.back().name] = seconds(random);
    }
    const auto slowest_over_mean = [&](const BakeTimes& known) {
      const std::vector<std::uint64_t> costs = expected_costs(inputs, known);
      std::vector<WorkItem> items;
      for (std::size_t k = 0; k < inputs.size(); ++k) items.push_back({inputs[k].name, costs[k]});
      const std::vector<std::uint32_t> shard_of = deal_out(items, shard_count);
      std::vector<double> load_s(shard_count);
      for (std::size_t k = 0; k < inputs.size(); ++k) load_s[shard_of[k]] += times[inputs[k].name];
      return std::ranges::max(load_s) * shard_count / sum_s;
    };
    EXPECT_LT(slowest_over_mean(times), 1.02);
    EXPECT_GT(slowest_over_mean({}), 1.02) << "the draw is too easy";
  }
}

TEST(Records, OfALaterVersionAreRefusedAndThoseOfEarlierOnesRead) {
  const auto parsed = [](const std::string& schema) {
    return parse_asset_records(
        R"({"schema":")" + schema + R"(","type":"asset","input":"m","output":"o","outcome":"ok"})" + "\n",
        "test");
  };
  ASSERT_TRUE(parsed("sqmap.bake/2"));
  EXPECT_EQ(parsed("sqmap.bake/2").value().records.size(), 1U);
  for (const char* schema : {"sqmap.bake/4", "sqmap.bake/3.1", "sqmap.bake/", "sqmap.bake/x"}) {
    const Result<AssetRecords> later = parsed(schema);
    ASSERT_FALSE(later) << schema;
    EXPECT_EQ(later.error().status, Status::kUnsupportedVersion);
    EXPECT_NE(later.error().finding.find("test:1"), std::string::npos);
  }
}

TEST(Merge, ASuccessReplacesAFailureWhicheverCameFirst) {
  for (const bool success_first : {false, true}) {
    std::vector<AssetRecord> records{record("a", "crashed"), record("a", "ok"), record("b", "timeout")};
    if (success_first) std::swap(records[0], records[1]);
    const MergedRecords merged = merge_records(records, nullptr);
    ASSERT_EQ(merged.records.size(), 2U);
    EXPECT_EQ(merged.records[0].outcome, "ok");
    EXPECT_EQ(merged.duplicate_count, 1U);
    EXPECT_FALSE(merged.is_complete()) << "b has no bundle";
  }
}

TEST(Merge, TimesAndTheCacheAreNoConflictButOtherBundlesAre) {
  const AssetRecord cold = record("a", "ok", R"(,"parts":3,"seconds":4.0,"cached":false)");
  const AssetRecord warm = record("a", "ok", R"(,"parts":3,"seconds":0.1,"cached":true)");
  const AssetRecord other = record("a", "ok", R"(,"parts":4,"seconds":4.0,"cached":false)");
  EXPECT_TRUE(merge_records({cold, warm}, nullptr).is_complete());
  const MergedRecords merged = merge_records({cold, other}, nullptr);
  EXPECT_EQ(merged.conflicting, std::vector<std::string>{"a"});
  EXPECT_FALSE(merged.is_complete());
}

TEST(Merge, TheHashesOfTheBundlesDecideWhereThereAreTwo) {
  const std::string one = R"(,"hash":"00000000000000000000000000000001")";
  const AssetRecord first = record("a", "ok", one + R"(,"parts":3)");
  const AssetRecord same = record("a", "ok", one + R"(,"parts":3,"warnings":["w"])");
  const AssetRecord other = record("a", "ok", R"(,"hash":"00000000000000000000000000000002","parts":3)");
  const AssetRecord old = record("a", "ok", R"(,"parts":3)"), old_other = record("a", "ok", R"(,"parts":4)");
  EXPECT_TRUE(merge_records({first, same}, nullptr).is_complete());
  EXPECT_EQ(merge_records({first, other}, nullptr).conflicting, std::vector<std::string>{"a"});
  EXPECT_TRUE(merge_records({first, old}, nullptr).is_complete()) << "a record of an older version has none";
  EXPECT_FALSE(merge_records({first, old_other}, nullptr).is_complete());
}

TEST(Merge, APlanWithoutAssetsIsNone) { EXPECT_FALSE(parse_plan("", "plan")); }

TEST(Merge, FollowsThePlanAndNamesWhatIsMissingOrTooMuch) {
  const Result<std::vector<PlannedAsset>> plan = parse_plan(
      "{\"type\":\"plan\",\"input\":\"1\",\"output\":\"z\"}\n{\"type\":\"plan\",\"output\":\"y\"}\n"
      "{\"type\":\"plan\",\"output\":\"a\"}\n",
      "plan");
  ASSERT_TRUE(plan);
  const MergedRecords merged =
      merge_records({record("a", "ok"), record("x", "ok"), record("z", "degraded")}, &plan.value());
  EXPECT_EQ(merged.missing, std::vector<std::string>{"y"});
  EXPECT_EQ(merged.unplanned, std::vector<std::string>{"x"});
  ASSERT_EQ(merged.records.size(), 3U);
  EXPECT_EQ(merged.records[0].output, "z");
  EXPECT_EQ(merged.records[1].output, "a");
  EXPECT_FALSE(merged.is_complete());
  EXPECT_EQ(merged.outcomes, (std::map<std::string, std::size_t>{{"degraded", 1}, {"ok", 2}}));
  EXPECT_FALSE(parse_plan("{\"type\":\"asset\",\"output\":\"a\"}\n", "plan"));
}

}  // namespace
}  // namespace sqmap::apps

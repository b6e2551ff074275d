// SPDX-License-Identifier: GPL-3.0-or-later
#include "../../apps/sqbake/determinism.hpp"

#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace sqmap::apps {
namespace {

BakeProduct product_of(std::vector<std::uint8_t> bundle) {
  BakeProduct product;
  product.bundle = std::move(bundle);
  return product;
}

/// What becomes of a bundle of the bytes 1 2 3 when the second bake gives this.
BakeProduct verified(const BakeProduct& second, unsigned threads = 1) {
  BakeProduct product = product_of({1, 2, 3});
  BakeJob job;
  job.threads = threads;
  verify_determinism(product, job, [&](unsigned /*threads*/) { return second; });
  return product;
}

TEST(VerifyDeterminism, KeepsABundleThatComesOutAgain) {
  const BakeProduct product = verified(product_of({1, 2, 3}));
  EXPECT_EQ(product.record.verdict, Verdict::kOk);
  EXPECT_FALSE(product.record.error.has_value());
  EXPECT_EQ(product.bundle, (std::vector<std::uint8_t>{1, 2, 3}));
  ASSERT_EQ(product.record.times.size(), 1U);
  EXPECT_EQ(product.record.times.front().stage, "verify");
}

TEST(VerifyDeterminism, FailsOnOneByteAndSaysWhichIsTheFirst) {
  const BakeProduct product = verified(product_of({1, 7, 8}));
  EXPECT_EQ(product.record.verdict, Verdict::kFailed);
  ASSERT_TRUE(product.record.error.has_value());
  EXPECT_EQ(product.record.error->status, Status::kBakeFailed);
  EXPECT_NE(product.record.error->finding.find("of 3 bytes, that at 1 "), std::string::npos)
      << product.record.error->finding;
  EXPECT_TRUE(product.bundle.empty());
}

TEST(VerifyDeterminism, FailsOnAnotherLength) {
  for (const auto& bundle : {std::vector<std::uint8_t>{1, 2, 3, 4}, {1, 2}, {}}) {
    const BakeProduct product = verified(product_of(bundle));
    EXPECT_EQ(product.record.verdict, Verdict::kFailed);
    ASSERT_TRUE(product.record.error.has_value());
    EXPECT_NE(product.record.error->finding.find("the other " + std::to_string(bundle.size())),
              std::string::npos)
        << product.record.error->finding;
    EXPECT_TRUE(product.bundle.empty());
  }
}

TEST(VerifyDeterminism, FailsAsTheSecondBakeDoes) {
  BakeProduct second;
  second.record.verdict = Verdict::kMemory;
  second.record.error = Error{Status::kBakeFailed, "out of memory", ""};
  const BakeProduct product = verified(second);
  EXPECT_EQ(product.record.verdict, Verdict::kMemory);
  ASSERT_TRUE(product.record.error.has_value());
  EXPECT_EQ(product.record.error->finding, "out of memory");
  EXPECT_TRUE(product.bundle.empty());
}

TEST(VerifyDeterminism, TakesAnotherNumberOfThreads) {
  for (const unsigned threads : {1U, 2U, 16U}) {
    BakeProduct product = product_of({1});
    BakeJob job;
    job.threads = threads;
    std::vector<unsigned> asked;
    verify_determinism(product, job, [&](unsigned count) {
      asked.push_back(count);
      return product_of({1});
    });
    ASSERT_EQ(asked.size(), 1U);
    EXPECT_NE(asked.front(), threads);
  }
}

}  // namespace
}  // namespace sqmap::apps

// SPDX-License-Identifier: GPL-3.0-or-later
#include "determinism.hpp"

#include <algorithm>
#include <chrono>
#include <string>

#include <fmt/format.h>

namespace sqmap::apps {
namespace {

/// Where two bakes of one input differ; empty: nowhere.
std::string difference(const std::vector<std::uint8_t>& a, const std::vector<std::uint8_t>& b) {
  if (a == b) return "";
  if (a.size() != b.size()) return fmt::format("one has {} bytes, the other {}", a.size(), b.size());
  const auto at = std::ranges::mismatch(a, b).in1 - a.begin();
  return fmt::format("of {} bytes, that at {} is the first that differs", a.size(), at);
}

}  // namespace

void verify_determinism(BakeProduct& product, const BakeJob& job,
                        const std::function<BakeProduct(unsigned threads)>& bake) {
  using Clock = std::chrono::steady_clock;
  const unsigned other_threads = job.threads == 1 ? 2 : 1;
  const Clock::time_point start = Clock::now();
  const BakeProduct again = bake(other_threads);
  BakeRecord& record = product.record;
  record.times.push_back({"verify", std::chrono::duration<double>(Clock::now() - start).count()});
  if (again.record.error) {
    record.verdict = again.record.verdict;
    record.error = again.record.error;
  } else if (const std::string where = difference(product.bundle, again.bundle); !where.empty()) {
    record.verdict = Verdict::kFailed;
    record.error =
        Error{Status::kBakeFailed,
              fmt::format("two bakes, with {} and {} threads, differ: {}", job.threads, other_threads, where),
              "report this with the mesh"};
  }
  if (record.error) product.bundle.clear();
}

}  // namespace sqmap::apps

// SPDX-License-Identifier: GPL-3.0-or-later
#include "job_cache.hpp"

#include <utility>

#include "sqmap/bake/version.hpp"

namespace sqmap::apps {

std::optional<BundleCache> open_cache(const BakeArguments& arguments) {
  // Neither a check of the baker nor its debugging has a use for what was baked before.
  if (!arguments.use_cache || arguments.verify_determinism || arguments.no_isolation) return std::nullopt;
  if (!arguments.cache.empty()) return BundleCache(arguments.cache);
  if (auto folder = BundleCache::default_folder()) return BundleCache(*std::move(folder));
  return std::nullopt;
}

CacheRequest cache_request(const Job& job) {
  const AssetOptions options = options_from(texts_of(job.settings)).value();
  // All that decides the bytes of a bundle but the files that are read. Limits do not: what runs into them is
  // not kept.
  return {job.input, job.output, {options.bake.to_json(), bake::algorithm_version()}};
}

}  // namespace sqmap::apps

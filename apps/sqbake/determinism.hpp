// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <functional>

#include "bake_asset.hpp"

namespace sqmap::apps {

/// Bakes once more with another number of threads and compares, byte for byte. Where the two differ, or the
/// second bake fails, the record says so and the bundle is gone.
///
/// @param product  of the first bake, with job.threads; succeeded
/// @param bake     bakes the same job with this number of threads
void verify_determinism(BakeProduct& product, const BakeJob& job,
                        const std::function<BakeProduct(unsigned threads)>& bake);

}  // namespace sqmap::apps

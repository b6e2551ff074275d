// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "../report/asset_records.hpp"

namespace sqmap::apps {

/// What a bake is expected to take, where nothing is known but the size of its input: no unit. A guess; see
/// kFixedCost.
std::uint64_t estimated_cost(std::uint64_t input_bytes);

/// Seconds that bakes took, by input.
using BakeTimes = std::map<std::string, double>;

/// Of several records of an input the last holds. Those that tell of no bake do not count: a bundle from the
/// cache, a bake that was cancelled.
BakeTimes bake_times(std::span<const AssetRecord> records);

struct InputFile {
  std::string name;  ///< as records call it
  std::uint64_t bytes{};
};

/// What the bake of each is expected to take, > 0, in one unit for all: its time where it has one, else its
/// estimate, which the median ratio of both makes comparable.
std::vector<std::uint64_t> expected_costs(std::span<const InputFile> inputs, const BakeTimes& times);

}  // namespace sqmap::apps

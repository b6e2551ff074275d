// SPDX-License-Identifier: GPL-3.0-or-later
//
// Resident bytes, beside those of the paper's Table 1.
#include <algorithm>
#include <array>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "peer_rows.hpp"
#include "suites.hpp"

namespace sqmap::bench {
namespace {

struct PaperRow {
  const char* model;
  double df_mb, adf_mb, sq_mb;
};
constexpr std::array<PaperRow, 7> kTable1{{{"Virtual hand", 344, 55, 4.6},
                                           {"Tiger", 312, 51, 4.3},
                                           {"Horse", 231, 37, 2.9},
                                           {"Elephant", 417, 68, 5.1},
                                           {"Camel", 196, 31, 2.4},
                                           {"Rhino", 295, 52, 3.8},
                                           {"Scene", 1795, 294, 23.1}}};

/// What an earlier suite found, or by building it.
double bytes_of(const Entrant& entrant, const Model& model, Results& results) {
  for (const PeerRow& row : results.peers)
    if (row.model == model.name && row.peer == entrant.id) return static_cast<double>(row.bytes);
  return static_cast<double>(build_peer(entrant, model, results).peer->bytes());
}

}  // namespace

void run_memory(const SuiteInput& input, Results& results) {
  for (const PaperRow& row : kTable1) {
    results.memory.push_back({row.model, "DF", row.df_mb * 1e6, true, "", 0});
    results.memory.push_back({row.model, "ADF", row.adf_mb * 1e6, true, "", 0});
    results.memory.push_back({row.model, "SQ", row.sq_mb * 1e6, true, "", 0});
  }
  std::vector<MemoryRow> scene;
  for (const Model& model : input.models) {
    input.note(fmt::format("memory: {}", model.name));
    const auto add = [&](MemoryRow row) {
      results.memory.push_back(row);
      auto it = std::find_if(scene.begin(), scene.end(),
                             [&](const MemoryRow& whole) { return whole.method == row.method; });
      if (it != scene.end()) {
        it->bytes += row.bytes;
        return;
      }
      row.model = "all models";
      scene.push_back(std::move(row));
    };
    add({model.name, "sqmap-bundle", static_cast<double>(model.bundle_bytes), false, "", 0});
    for (const Entrant& entrant : accuracy_entrants(model, input.is_smoke)) {
      if (entrant.id.find("-level") != std::string::npos) continue;  // levels are views of one map
      add({model.name, entrant.id, bytes_of(entrant, model, results), false, entrant.family,
           entrant.density});
    }
  }
  results.memory.insert(results.memory.end(), scene.begin(), scene.end());
}

}  // namespace sqmap::bench

// SPDX-License-Identifier: GPL-3.0-or-later
//
// Resident bytes, beside those of the paper's Table 1.
#include <array>

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

}  // namespace

void run_memory(const SuiteInput& input, Results& results) {
  for (const PaperRow& row : kTable1) {
    results.memory.push_back({row.model, "DF", row.df_mb * 1e6, true});
    results.memory.push_back({row.model, "ADF", row.adf_mb * 1e6, true});
    results.memory.push_back({row.model, "SQ", row.sq_mb * 1e6, true});
  }
  std::map<std::string, double> scene;
  for (const Model& model : input.models) {
    input.note(fmt::format("memory: {}", model.name));
    const auto add = [&](const std::string& method, double bytes) {
      results.memory.push_back({model.name, method, bytes, false});
      scene[method] += bytes;
    };
    add("sqmap-bundle", static_cast<double>(model.bundle_bytes));
    for (const Entrant& entrant : accuracy_entrants(model, input.is_smoke)) {
      if (entrant.id.find("-level") != std::string::npos) continue;  // levels are views of one map
      add(entrant.id, static_cast<double>(build_peer(entrant, model, results).peer->bytes()));
    }
  }
  for (const auto& [method, bytes] : scene) results.memory.push_back({"all models", method, bytes, false});
}

}  // namespace sqmap::bench

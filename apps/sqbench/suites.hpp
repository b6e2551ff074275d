// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "model.hpp"
#include "results.hpp"

namespace sqmap::bench {

struct SuiteInput {
  std::vector<Model> models;
  bake::Mesh probe;  ///< R_max = 1
  bool is_smoke{};
  std::function<void(const std::string&)> note;  ///< says what is going on
};

/// A suite adds its rows and checks to the results. May throw what the peers' libraries throw.
struct Suite {
  const char* name;
  const char* summary;
  void (*run)(const SuiteInput& input, Results& results);
};

void run_frames(const SuiteInput& input, Results& results);
void run_accuracy(const SuiteInput& input, Results& results);
void run_memory(const SuiteInput& input, Results& results);
void run_bake(const SuiteInput& input, Results& results);
void run_force(const SuiteInput& input, Results& results);
void run_effects(const SuiteInput& input, Results& results);
void run_budget(const SuiteInput& input, Results& results);
void run_size(const SuiteInput& input, Results& results);

}  // namespace sqmap::bench

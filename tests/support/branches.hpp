// SPDX-License-Identifier: Apache-2.0
//
// Properties over random cases that say which branches their cases took.
#pragma once

#include <cstdlib>
#include <map>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "sqmap/asset/vec.hpp"

namespace sqmap::test {

/// Counts the branches that cases take; the test that owns it fails where one has fewer than it should.
class Branches {
 public:
  void take(const std::string& name) { ++taken_[name]; }
  /// Of each pair of branches, the one that a case took.
  void take(bool is_first, const std::string& first, const std::string& second) {
    take(is_first ? first : second);
  }
  int count(const std::string& name) const {
    const auto at = taken_.find(name);
    return at == taken_.end() ? 0 : at->second;
  }
  void expect(const std::vector<std::string>& names, int least) const {
    for (const std::string& name : names)
      EXPECT_GE(count(name), least) << "branch \"" << name << "\" was hardly taken";
  }
  /// For a branch that cases may take because a weakness is known: it must not grow.
  void expect_at_most(const std::string& name, int most) const {
    EXPECT_LE(count(name), most) << "branch \"" << name << "\" was taken too often";
  }

 private:
  std::map<std::string, int> taken_;
};

/// Call while the program's globals are set up, before RapidCheck's first case. A value from outside wins, so
/// that more cases can be asked for.
inline bool seed_rapidcheck(const char* params) { return setenv("RC_PARAMS", params, 0) == 0; }

/// Checks a property without rapidcheck's macro, so that the branches can be looked at afterwards.
template <class Property>
void check(const Property& property) {
  ASSERT_NE(std::getenv("RC_PARAMS"), nullptr) << "seed_rapidcheck() was not called";
  EXPECT_TRUE(rc::check(property));
}

/// A number of [-1, 1], all alike likely from the first case on; shrinks towards 0.
inline double share() {
  return *rc::gen::resize(rc::kNominalSize, rc::gen::inRange(-100000, 100001)) / 100000.0;
}
inline Vec3d vector() {
  const double x = share(), y = share();
  return {x, y, share()};
}

}  // namespace sqmap::test

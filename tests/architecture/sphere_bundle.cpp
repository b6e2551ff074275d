// SPDX-License-Identifier: Apache-2.0
// Usage: sphere_bundle OUT.h5. Writes sphere_asset() for the tests that need a bundle with known answers.
#include <cstdio>

#include "sqmap/io/bundle.hpp"

#include "sphere_asset.hpp"

int main(int argc, char** argv) {
  if (argc != 2) return 1;
  const sqmap::Outcome written = sqmap::io::write(sqmap::test::sphere_asset(), argv[1]);
  if (written) return 0;
  std::fprintf(stderr, "sphere_bundle: %s\n", written.error().finding.c_str());
  return 1;
}

// SPDX-License-Identifier: Apache-2.0
// show_toys BUNDLE.h5...: prints how deep the origin lies in each object.
#include <cstdio>

#include "sqmap/io/bundle.hpp"
#include "sqmap/runtime/object.hpp"

int main(int argc, char** argv) {
  for (int i = 1; i < argc; ++i) {
    const auto asset = sqmap::io::read(argv[i]);
    if (!asset) return std::fprintf(stderr, "show_toys: %s\n", asset.error().finding.c_str()), 1;
    const auto object = sqmap::runtime::Object::build(asset.value());
    if (!object) return std::fprintf(stderr, "show_toys: %s\n", object.error().finding.c_str()), 1;
    const auto answer = object.value().query({0, 0, 0});
    std::printf("%s: %zu parts, the origin at %.3f m\n", asset.value().provenance.source_name.c_str(),
                asset.value().parts.size(), static_cast<double>(answer.signed_distance_m));
  }
}

// SPDX-License-Identifier: Apache-2.0
//
// Usage: fuzz_replay_TARGET [--write-seeds FOLDER] MUTATIONS [FILE|FOLDER]...
//
// Runs a fuzz target without libFuzzer: its seeds, MUTATIONS random changes of each with fixed random
// numbers, and the given files. With --write-seeds, only writes the seeds there.
#include <algorithm>
#include <charconv>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <memory>
#include <random>
#include <string>

#include "fuzz/target.hpp"

namespace {

using sqmap::fuzz::Bytes;

void run(const Bytes& input) {
  // A copy of exactly this size, so that AddressSanitizer sees every read beyond it.
  const auto exact = std::make_unique<std::uint8_t[]>(input.size());
  std::copy(input.begin(), input.end(), exact.get());
  LLVMFuzzerTestOneInput(exact.get(), input.size());
}

/// One to four changes of the kinds that parsers stumble over.
Bytes mutated(Bytes bytes, std::mt19937_64& random) {
  constexpr std::uint8_t kEdges[] = {0x00, 0x01, 0x7F, 0x80, 0xFE, 0xFF};
  const auto below = [&](std::size_t count) { return static_cast<std::size_t>(random() % count); };
  const std::size_t changes = 1 + below(4);
  for (std::size_t k = 0; k < changes && !bytes.empty(); ++k) {
    const std::size_t at = below(bytes.size()),
                      length = 1 + below(std::min<std::size_t>(8, bytes.size() - at));
    const auto first = bytes.begin() + static_cast<std::ptrdiff_t>(at);
    switch (below(6)) {
      case 0:
        *first ^= static_cast<std::uint8_t>(1U << below(8));
        break;
      case 1:
        *first = kEdges[below(std::size(kEdges))];
        break;
      case 2:
        std::fill_n(first, length, kEdges[below(std::size(kEdges))]);
        break;
      case 3: {  // what stands elsewhere, here
        const std::size_t from = below(bytes.size() - length + 1);
        std::memmove(&*first, bytes.data() + from, length);
        break;
      }
      case 4:
        bytes.erase(first, first + static_cast<std::ptrdiff_t>(length));
        break;
      default:
        bytes.resize(at);
    }
  }
  return bytes;
}

Bytes load(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) {
    std::fprintf(stderr, "cannot read %s\n", path.c_str());
    std::exit(2);
  }
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

int write_seeds(const std::filesystem::path& folder) {
  std::filesystem::create_directories(folder);
  int number = 0;
  for (const Bytes& seed : sqmap::fuzz::seeds()) {
    std::ofstream file(folder / ("seed_" + std::to_string(number++)), std::ios::binary);
    file.write(reinterpret_cast<const char*>(seed.data()), static_cast<std::streamsize>(seed.size()));
    if (!file) return 2;
  }
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc == 3 && std::strcmp(argv[1], "--write-seeds") == 0) return write_seeds(argv[2]);
  int mutations = -1;
  if (argc >= 2) std::from_chars(argv[1], argv[1] + std::strlen(argv[1]), mutations);
  if (mutations < 0) {
    std::fprintf(stderr, "usage: %s [--write-seeds FOLDER] MUTATIONS [FILE|FOLDER]...\n", argv[0]);
    return 2;
  }
  std::size_t runs = 0;
  run({});
  for (const Bytes& seed : sqmap::fuzz::seeds()) {
    run(seed);
    std::mt19937_64 random(6);
    for (int k = 0; k < mutations; ++k) run(mutated(seed, random));
    runs += static_cast<std::size_t>(mutations) + 1;
  }
  for (int k = 2; k < argc; ++k) {
    const std::filesystem::path path = argv[k];
    std::vector<std::filesystem::path> files{path};
    if (std::filesystem::is_directory(path)) {
      files.assign(std::filesystem::directory_iterator(path), std::filesystem::directory_iterator());
      std::sort(files.begin(), files.end());
    }
    for (const auto& file : files) run(load(file));
    runs += files.size();
  }
  std::printf("%zu inputs\n", runs);
}

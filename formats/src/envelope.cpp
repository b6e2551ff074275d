// SPDX-License-Identifier: Apache-2.0
#include "envelope.hpp"

#include <algorithm>
#include <array>
#include <cstring>
#include <string>

#include "sqmap/asset/version.hpp"

#include "digest.hpp"

namespace sqmap::io {
namespace {

constexpr std::array<std::uint8_t, 8> kMagic{'S', 'Q', 'M', 'A', 'P', 0x1A, '\n', 0};
constexpr std::array<std::uint8_t, 8> kHdf5Signature{0x89, 'H', 'D', 'F', '\r', '\n', 0x1A, '\n'};
constexpr std::size_t kMajorAt = 8, kMinorAt = 12, kLengthAt = 16, kDigestAt = 24, kDigestEnd = 40;

Digest digest_of(std::span<const std::uint8_t> bundle) {
  constexpr Digest kZeros{};
  const std::span<const std::uint8_t> pieces[] = {bundle.first(kDigestAt), kZeros,
                                                  bundle.subspan(kDigestEnd)};
  return xxh3_128(pieces);
}

template <class T>
T load(std::span<const std::uint8_t> bytes, std::size_t at) {
  T value;
  std::memcpy(&value, bytes.data() + at, sizeof(T));
  return value;
}

bool starts_with(std::span<const std::uint8_t> bytes, std::span<const std::uint8_t> prefix) {
  return bytes.size() >= prefix.size() && std::equal(prefix.begin(), prefix.end(), bytes.begin());
}

std::string version_text(std::uint32_t major, std::uint32_t minor) {
  return std::to_string(major) + "." + std::to_string(minor);
}

}  // namespace

void seal(std::span<std::uint8_t> bundle, std::uint32_t minor) {
  const std::uint64_t length = bundle.size();
  std::fill_n(bundle.begin(), kEnvelopeBytes, std::uint8_t{0});
  std::copy(kMagic.begin(), kMagic.end(), bundle.begin());
  std::memcpy(bundle.data() + kMajorAt, &kFormatMajor, 4);
  std::memcpy(bundle.data() + kMinorAt, &minor, 4);
  std::memcpy(bundle.data() + kLengthAt, &length, 8);
  const Digest digest = digest_of(bundle);
  std::copy(digest.begin(), digest.end(), bundle.begin() + kDigestAt);
}

Outcome check_envelope(std::span<const std::uint8_t> bundle) {
  if (!starts_with(bundle, kMagic)) {
    if (starts_with(bundle, kHdf5Signature))
      return Error{Status::kInvalidAsset, "an HDF5 file without the sqmap header in front of it",
                   "use the file as sqbake wrote it: rewriting it with an HDF5 tool drops the header"};
    return Error{Status::kInvalidAsset,
                 "no sqmap bundle: the first 8 bytes of " + std::to_string(bundle.size()) +
                     " must be \"SQMAP\" 1A 0A 00",
                 "give a bundle that sqbake wrote"};
  }
  if (bundle.size() < kEnvelopeBytes)
    return Error{Status::kInvalidAsset,
                 "bundle cut short: " + std::to_string(bundle.size()) + " bytes, the header alone has " +
                     std::to_string(kEnvelopeBytes),
                 "copy the file again, or bake the asset again"};

  // Before length and digest: what follows byte 16 is for each major version to define.
  const auto major = load<std::uint32_t>(bundle, kMajorAt);
  const auto minor = load<std::uint32_t>(bundle, kMinorAt);
  if (major != kFormatMajor || minor > kFormatMinor)
    return Error{Status::kUnsupportedVersion,
                 "bundle of format version " + version_text(major, minor) + ", this reader knows " +
                     version_text(kFormatMajor, 0) + " to " + version_text(kFormatMajor, kFormatMinor),
                 major >= kFormatMajor ? "use a newer sqmap, or bake the asset with this one"
                                       : "bake the asset again"};

  const auto length = load<std::uint64_t>(bundle, kLengthAt);
  if (length != bundle.size())
    return Error{
        Status::kInvalidAsset,
        "bundle of " + std::to_string(bundle.size()) + " bytes, its header says " + std::to_string(length),
        "copy the file again, or bake the asset again"};
  const Digest found = digest_of(bundle);
  if (!std::equal(found.begin(), found.end(), bundle.begin() + kDigestAt))
    return Error{
        Status::kInvalidAsset,
        "bundle damaged: its bytes have the digest " + to_hex(found) + ", which is not the one in its header",
        "copy the file again, or bake the asset again"};
  return Done{};
}

}  // namespace sqmap::io

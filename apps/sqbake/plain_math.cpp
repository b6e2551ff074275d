// SPDX-License-Identifier: GPL-3.0-or-later
#include "plain_math.hpp"

#include <cstdlib>
#include <string>

#include <unistd.h>

namespace sqmap::apps {

void use_plain_math([[maybe_unused]] char** argv) {
#if defined(__x86_64__) && defined(__GLIBC__)
  static constexpr const char* kVariable = "GLIBC_TUNABLES";
  static const std::string kCapabilities = "glibc.cpu.hwcaps=", kWithout = "-AVX2,-FMA,-FMA4";
  const char* given = std::getenv(kVariable);
  std::string tunables = given != nullptr ? given : "";
  if (tunables.find(kWithout) != std::string::npos) return;
  if (const auto at = tunables.find(kCapabilities); at != std::string::npos) {
    tunables.insert(at + kCapabilities.size(), kWithout + ",");
  } else {
    tunables += (tunables.empty() ? "" : ":") + kCapabilities + kWithout;
  }
  if (::setenv(kVariable, tunables.c_str(), 1) != 0) return;
  ::execv("/proc/self/exe", argv);
#endif
}

}  // namespace sqmap::apps

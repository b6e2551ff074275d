// SPDX-License-Identifier: Apache-2.0
#include "untrusted.hpp"

#include "../common/confinement.hpp"

namespace sqmap::apps {

Exit run_untrusted(Console& console, const std::string& files, const std::function<Exit(Console&)>& command) {
  return run_confined(console, {{.address_bytes = kUntrustedMemoryBytes, .cpu_s = kUntrustedCpu_s},
                                files,
                                "do not open it without --untrusted; bake it again if it is yours",
                                command});
}

}  // namespace sqmap::apps

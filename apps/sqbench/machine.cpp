// SPDX-License-Identifier: GPL-3.0-or-later
#include <fstream>
#include <string>
#include <thread>

#include <sys/utsname.h>

#include "grid_kernels.hpp"
#include "results.hpp"

namespace sqmap::bench {

Machine this_machine(bool is_pinned) {
  Machine machine;
  machine.is_pinned = is_pinned;
  machine.cores = std::thread::hardware_concurrency();
  machine.instruction_set = instruction_set();
#ifdef __clang__
  machine.compiler = "Clang " __clang_version__;
#else
  machine.compiler = "GCC " __VERSION__;
#endif
  std::ifstream info("/proc/cpuinfo");
  for (std::string line; std::getline(info, line) && machine.cpu.empty();)
    if (line.starts_with("model name")) machine.cpu = line.substr(line.find(": ") + 2);
  utsname system{};
  if (uname(&system) == 0)
    machine.kernel = std::string(static_cast<const char*>(system.sysname)) + " " +
                     static_cast<const char*>(system.release);
  return machine;
}

}  // namespace sqmap::bench

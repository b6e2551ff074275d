// SPDX-License-Identifier: GPL-3.0-or-later
#include <fstream>
#include <string>
#include <thread>

#include <CGAL/version.h>
#include <LinearMath/btScalar.h>
#include <embree3/rtcore.h>
#include <fcl/config.h>
#include <fmt/format.h>
#include <hwy/highway.h>
#include <nanovdb/NanoVDB.h>
#include <openvdb/version.h>
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
  machine.libraries = fmt::format(
      "Bullet {}.{:02}, CGAL {}.{}.{}, Embree {}, FCL {}, Highway {}.{}.{}, NanoVDB {}.{}.{}, OpenVDB {}",
      BT_BULLET_VERSION / 100, BT_BULLET_VERSION % 100, CGAL_VERSION_MAJOR, CGAL_VERSION_MINOR,
      CGAL_VERSION_PATCH, RTC_VERSION_STRING, FCL_VERSION, HWY_MAJOR, HWY_MINOR, HWY_PATCH,
      NANOVDB_MAJOR_VERSION_NUMBER, NANOVDB_MINOR_VERSION_NUMBER, NANOVDB_PATCH_VERSION_NUMBER,
      OPENVDB_LIBRARY_VERSION_STRING);
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

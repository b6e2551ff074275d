// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include "program.hpp"

namespace sqmap::apps {

/// What a process that reads files of strangers may still do. 0: as much as before.
struct Confinement {
  std::uint64_t address_bytes = 0;  ///< address space; not under sanitizers, which reserve terabytes
  std::uint64_t heap_bytes = 0;     ///< private writable memory: heap and mappings; not under sanitizers
  std::uint64_t cpu_s = 0;          ///< processor time
  bool may_start_threads = false;
};

/// Whatever asks the system for programs, processes, sockets, other processes' memory or signals to them
/// ends the calling process with SIGSYS from now on, in all threads it starts later. False: the system
/// refuses. On other systems than x86-64 Linux it does nothing and is true.
bool deny_system_calls(bool may_start_threads);

/// Confines the calling process, for good, and lets it end with its parent and without a core.
bool confine(const Confinement& bounds);

/// The memory of the machine [bytes]; 0: unknown.
std::uint64_t physical_memory_bytes();

/// False under a sanitizer whose own maps exceed any bound.
bool may_bound_memory() noexcept;

/// A command to be run in a confined child.
struct ConfinedCommand {
  Confinement bounds;
  std::string files;   ///< what the command reads, for messages
  std::string remedy;  ///< what to do about a file that ends the child
  std::function<Exit(Console&)> run;
};

/// Runs a command in a child process. Whatever ends the child is one error of this process.
Exit run_confined(Console& console, const ConfinedCommand& command);

}  // namespace sqmap::apps

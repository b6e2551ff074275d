// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include "../common/program.hpp"

namespace sqmap::apps {

/// What a child of run_untrusted may use. Memory is address space: io::decode asks for 2 GiB at most with its
/// default limits, beside the file of at most 256 MiB.
inline constexpr std::uint64_t kUntrustedMemoryBytes = std::uint64_t{3} << 30;
inline constexpr std::uint64_t kUntrustedCpu_s = 60;

/// Runs a command in a child process that has bounded memory and processor time, leaves no core, and on
/// x86-64 Linux may neither start programs nor processes nor open sockets. Whatever ends the child is one
/// error of this process.
///
/// @param files  what the command reads, for the message
Exit run_untrusted(Console& console, const std::string& files, const std::function<Exit(Console&)>& command);

}  // namespace sqmap::apps

// SPDX-License-Identifier: Apache-2.0
//
// Replaces operator new of the whole test program: include it in one source only.
#pragma once

#include <atomic>
#include <cstdio>
#include <cstdlib>
#include <new>

namespace sqmap::test {

inline std::atomic<bool> allocation_is_forbidden{false};

/// While one lives, any allocation ends the program.
struct NoAllocation {
  NoAllocation() { allocation_is_forbidden = true; }
  ~NoAllocation() { allocation_is_forbidden = false; }
  NoAllocation(const NoAllocation&) = delete;
  NoAllocation& operator=(const NoAllocation&) = delete;
};

inline void* allocate(std::size_t size) {
  if (allocation_is_forbidden) {
    std::fputs("an allocation where none is allowed\n", stderr);
    std::abort();
  }
  void* memory = std::malloc(size > 0 ? size : 1);
  if (memory == nullptr) std::abort();
  return memory;
}

}  // namespace sqmap::test

// NOLINTBEGIN(misc-definitions-in-headers): one source includes them
// Not inlined: GCC would see free() called for what it knows to come from operator new, and warn.
[[gnu::noinline]] void* operator new(std::size_t size) { return sqmap::test::allocate(size); }
[[gnu::noinline]] void* operator new[](std::size_t size) { return sqmap::test::allocate(size); }
[[gnu::noinline]] void operator delete(void* memory) noexcept { std::free(memory); }
[[gnu::noinline]] void operator delete[](void* memory) noexcept { std::free(memory); }
[[gnu::noinline]] void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
[[gnu::noinline]] void operator delete[](void* memory, std::size_t) noexcept { std::free(memory); }
// Sanitizers bring these as well, which would not go with the delete above.
[[gnu::noinline]] void* operator new(std::size_t size, const std::nothrow_t&) noexcept {
  return sqmap::test::allocate(size);
}
[[gnu::noinline]] void* operator new[](std::size_t size, const std::nothrow_t&) noexcept {
  return sqmap::test::allocate(size);
}
// NOLINTEND(misc-definitions-in-headers)

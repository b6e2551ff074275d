// SPDX-License-Identifier: Apache-2.0
//
// Highway is used as headers only: its own dispatch would make every user of a static sqmap::runtime link
// libhwy.
#include "engine.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>

#include "body_data.hpp"
#include "chart.hpp"
#include "entries.hpp"
#include "powers.hpp"

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define SQMAP_SANITIZED
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
#define SQMAP_SANITIZED
#endif
#endif

// The baseline is what the compiler was told to assume: NEON on ARM, HWY_SCALAR (one lane, plain C++) on
// x86-64.
#define HWY_DISABLED_TARGETS \
  (HWY_SSSE3 | HWY_AVX3_DL | HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128 | HWY_RVV | HWY_WASM | HWY_PPC8)
#define HWY_IS_DEBUG_BUILD 0  // its checks call into libhwy
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "engine.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

// The larger parts of a kernel. Inlined they are one loop without calls; with sanitizers that loop grows
// until compilers take minutes over it.
#undef SQMAP_KERNEL
#if defined(SQMAP_SANITIZED)
#define SQMAP_KERNEL HWY_NOINLINE
#else
#define SQMAP_KERNEL HWY_INLINE
#endif

HWY_BEFORE_NAMESPACE();
namespace sqmap::runtime::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;
#include "packing.inl"
//
#include "lanes.inl"
//
#include "bends.inl"
//
#include "look.inl"
//
#include "walk.inl"
//
#include "fans.inl"
//
#include "cull.inl"
//
#include "bounds.inl"
//
#include "batch.inl"
//
#include "body.inl"
}  // namespace sqmap::runtime::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace sqmap::runtime {

namespace {

#define SQMAP_HAS_TARGET(target) ((HWY_TARGETS & (target)) != 0)

bool runs(SimdTarget target) noexcept {
#if HWY_ARCH_X86
  __builtin_cpu_init();
  const bool sse4 = __builtin_cpu_supports("ssse3") && __builtin_cpu_supports("sse4.2");
  const bool avx2 = sse4 && __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") &&
                    __builtin_cpu_supports("bmi") && __builtin_cpu_supports("bmi2");
  switch (target) {
    case SimdTarget::kBaseline:
      return true;
    case SimdTarget::kSse4:
      return sse4;
    case SimdTarget::kAvx2:
      return avx2;
    case SimdTarget::kAvx512:
      return avx2 && __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512vl") &&
             __builtin_cpu_supports("avx512bw") && __builtin_cpu_supports("avx512dq") &&
             __builtin_cpu_supports("avx512cd");
  }
  return false;
#else
  return target == SimdTarget::kBaseline;
#endif
}

/// Null: not compiled.
const Kernels* kernels_of(SimdTarget target) noexcept {
  switch (target) {
    case SimdTarget::kBaseline:
      return &HWY_NAMESPACE::kKernels;
    case SimdTarget::kSse4:
#if SQMAP_HAS_TARGET(HWY_SSE4)
      return &N_SSE4::kKernels;
#else
      return nullptr;
#endif
    case SimdTarget::kAvx2:
#if SQMAP_HAS_TARGET(HWY_AVX2)
      return &N_AVX2::kKernels;
#else
      return nullptr;
#endif
    case SimdTarget::kAvx512:
#if SQMAP_HAS_TARGET(HWY_AVX3)
      return &N_AVX3::kKernels;
#else
      return nullptr;
#endif
  }
  return nullptr;
}

constexpr SimdTarget kTargets[] = {SimdTarget::kAvx512, SimdTarget::kAvx2, SimdTarget::kSse4,
                                   SimdTarget::kBaseline};

// Two threads that ask first find the same answer; nobody waits.
std::atomic<const Kernels*> chosen{nullptr};

}  // namespace

bool is_supported(SimdTarget target) noexcept { return kernels_of(target) != nullptr && runs(target); }

bool set_simd_target(SimdTarget target) noexcept {
  if (!is_supported(target)) return false;
  chosen.store(kernels_of(target), std::memory_order_relaxed);
  return true;
}

const Kernels& kernels() noexcept {
  const Kernels* known = chosen.load(std::memory_order_relaxed);
  if (known != nullptr) return *known;
  for (const SimdTarget target : kTargets) {
    if (set_simd_target(target)) break;
  }
  return *chosen.load(std::memory_order_relaxed);
}

SimdTarget simd_target() noexcept {
  const Kernels& known = kernels();
  for (const SimdTarget target : kTargets) {
    if (kernels_of(target) == &known) return target;
  }
  return SimdTarget::kBaseline;
}

}  // namespace sqmap::runtime
#endif

// SPDX-License-Identifier: Apache-2.0
//
// Moves the lanes of a mask to the front of a vector. Included once for each target, where hn is Highway's
// namespace for it; needs <array> and <cstdint>. sqbench's grids use it, too: a rival whose
// vectors are packed worse would be beaten unfairly.

#if HWY_TARGET > HWY_AVX3  // no AVX-512
/// The lanes that a mask of eight bits names, ascending, and then the others.
consteval auto front_orders() {
  std::array<std::array<std::uint8_t, 8>, 256> orders{};
  for (unsigned bits = 0; bits < 256; ++bits) {
    std::size_t place = 0;
    for (const unsigned wanted : {1U, 0U})
      for (unsigned lane = 0; lane < 8; ++lane)
        if ((bits >> lane & 1U) == wanted) orders[bits][place++] = static_cast<std::uint8_t>(lane);
  }
  return orders;
}
inline constexpr auto kFrontOrders = front_orders();
#endif

/// hn::Compress of many vectors by one mask. Highway 1.0 has that copy a kilobyte to the stack for every
/// vector where the processor has no instruction for it.
class Packing {
  using Floats = hn::ScalableTag<float>;
  using Ints = hn::RebindToSigned<Floats>;

 public:
  HWY_INLINE explicit Packing(hn::Mask<Floats> mask) : mask_(mask) {
#if HWY_TARGET > HWY_AVX3  // no AVX-512
    HWY_ALIGN std::uint8_t bytes[8] = {};
    hn::StoreMaskBits(Floats(), mask, bytes);
    order_ =
        hn::PromoteTo(Ints(), hn::LoadU(hn::Rebind<std::uint8_t, Floats>(), kFrontOrders[bytes[0]].data()));
#endif
  }
  HWY_INLINE std::uint32_t count() const {
    return static_cast<std::uint32_t>(hn::CountTrue(Floats(), mask_));
  }
#if HWY_TARGET <= HWY_AVX3
  HWY_INLINE hn::Vec<Floats> operator()(hn::Vec<Floats> value) const { return hn::Compress(value, mask_); }
  HWY_INLINE hn::Vec<Ints> operator()(hn::Vec<Ints> value) const {
    return hn::Compress(value, hn::RebindMask(Ints(), mask_));
  }
#else
  HWY_INLINE hn::Vec<Floats> operator()(hn::Vec<Floats> value) const {
    return hn::TableLookupLanes(value, hn::IndicesFromVec(Floats(), order_));
  }
  HWY_INLINE hn::Vec<Ints> operator()(hn::Vec<Ints> value) const {
    return hn::TableLookupLanes(value, hn::IndicesFromVec(Ints(), order_));
  }
#endif

 private:
  hn::Mask<Floats> mask_;
#if HWY_TARGET > HWY_AVX3  // no AVX-512
  hn::Vec<Ints> order_;
#endif
};

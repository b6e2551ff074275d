// SPDX-License-Identifier: Apache-2.0
#include "hdf5_handle.hpp"

#include <type_traits>

#include <hdf5.h>

namespace sqmap::io {

static_assert(std::is_same_v<hid_t, std::int64_t> && std::is_same_v<herr_t, int>, "HDF5 1.10 or later");

namespace {

std::mutex& session_mutex() {
  static std::mutex mutex;
  return mutex;
}

}  // namespace

Hdf5Session::Hdf5Session() : lock_(session_mutex()) {
  H5open();
  H5Eget_auto2(H5E_DEFAULT, &print_, &print_data_);
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
  H5PLget_loading_state(&plugin_state_);
  H5PLset_loading_state(0);
}

Hdf5Session::~Hdf5Session() {
  H5PLset_loading_state(plugin_state_);
  H5Eclear2(H5E_DEFAULT);
  H5Eset_auto2(H5E_DEFAULT, print_, print_data_);
}

std::string Hdf5Session::unique_name() const {
  static std::uint64_t count = 0;  // guarded by lock_
  return "sqmap-in-memory-" + std::to_string(count++);
}

std::int64_t hdf5_type(Element element) noexcept {
  switch (element) {
    case Element::kU8:
      return H5T_STD_U8LE;
    case Element::kU16:
      return H5T_STD_U16LE;
    case Element::kU32:
      return H5T_STD_U32LE;
    case Element::kF64:
      return H5T_IEEE_F64LE;
  }
  return H5I_INVALID_HID;
}

}  // namespace sqmap::io

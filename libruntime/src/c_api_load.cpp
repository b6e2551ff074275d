// SPDX-License-Identifier: Apache-2.0
// The part of the C interface that opens bundles: apart from the rest, so that a program that makes its own
// assets links without HDF5.
#include <cstdint>
#include <span>

#include "sqmap/io/bundle.hpp"

#include "c_api.hpp"

using namespace sqmap::runtime;

namespace {

sqmap_status object_of(const sqmap::Result<sqmap::Asset>& asset, sqmap_object** object, sqmap_error* error) {
  return asset ? c_object(asset.value(), object, error) : c_failure(asset.error(), error);
}

}  // namespace

sqmap_status sqmap_object_load_file(const char* path, sqmap_object** object, sqmap_error* error) {
  if (path == nullptr || object == nullptr)
    return c_failure(SQMAP_NULL_ARGUMENT, "path or object is NULL", "pass both", error);
  return c_guarded(error, [&] { return object_of(sqmap::io::read(path), object, error); });
}

sqmap_status sqmap_object_load_memory(const void* bytes, std::size_t byte_count, sqmap_object** object,
                                      sqmap_error* error) {
  if (bytes == nullptr || object == nullptr)
    return c_failure(SQMAP_NULL_ARGUMENT, "bytes or object is NULL", "pass both", error);
  return c_guarded(error, [&] {
    const std::span span(static_cast<const std::uint8_t*>(bytes), byte_count);
    return object_of(sqmap::io::decode(span), object, error);
  });
}

// SPDX-License-Identifier: Apache-2.0
#include <cstring>
#include <string>
#include <utility>

#include <hdf5.h>

#include "sqmap/asset/validate.hpp"
#include "sqmap/io/bundle.hpp"

#include "envelope.hpp"
#include "file_bytes.hpp"
#include "hdf5_handle.hpp"
#include "tables.hpp"

namespace sqmap::io {
namespace {

constexpr unsigned kDeflateLevel = 9;
constexpr unsigned kManyEntries =
    256;  // more links and attributes than any group has: HDF5 then keeps them compact
constexpr std::size_t kGrowBytes = std::size_t{64} * 1024;
constexpr std::size_t kEofAt = kEnvelopeBytes + 28;  // end-of-file address in superblock versions 2 and 3

// The file grows inside our own vector. H5Fget_file_image would be simpler, but in HDF5 1.10 it changes a
// byte of the superblock without its checksum, and leaves out the user block.
void* grow(void*, size_t size, H5FD_file_image_op_t, void* image) {
  auto& bytes = *static_cast<Bytes*>(image);
  try {
    bytes.resize(size);
  } catch (...) {  // out of memory; no exception may cross HDF5
    return nullptr;
  }
  return bytes.data();
}
void* allocate(size_t size, H5FD_file_image_op_t op, void* image) { return grow(nullptr, size, op, image); }
void* copy(void* to, const void* from, size_t size, H5FD_file_image_op_t, void*) {
  return std::memcpy(to, from, size);
}
herr_t keep(void*, H5FD_file_image_op_t, void*) { return 0; }
void* share(void* image) { return image; }
herr_t unshare(void*) { return 0; }

Hdf5Handle create_file(const std::string& name, Bytes& image) {
  const Hdf5Handle creation(H5Pcreate(H5P_FILE_CREATE), H5Pclose);
  const Hdf5Handle access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose);
  H5FD_file_image_callbacks_t callbacks{allocate, copy, grow, keep, share, unshare, &image};
  const bool set = H5Pset_userblock(creation.get(), kEnvelopeBytes) >= 0 &&
                   H5Pset_obj_track_times(creation.get(), false) >= 0 &&
                   H5Pset_attr_phase_change(creation.get(), kManyEntries, 0) >= 0 &&
                   H5Pset_link_phase_change(creation.get(), kManyEntries, 0) >= 0 &&
                   H5Pset_fapl_core(access.get(), kGrowBytes, false) >= 0 &&
                   H5Pset_file_image_callbacks(access.get(), &callbacks) >= 0 &&
                   H5Pset_fclose_degree(access.get(), H5F_CLOSE_STRONG) >= 0 &&
                   H5Pset_libver_bounds(access.get(), H5F_LIBVER_V110, H5F_LIBVER_V110) >= 0 &&
                   // Blocks to allocate from would leave unused gaps between the small objects of a bundle.
                   H5Pset_meta_block_size(access.get(), 0) >= 0 &&
                   H5Pset_small_data_block_size(access.get(), 0) >= 0;
  if (!set) return {};
  Hdf5Handle file(H5Fcreate(name.c_str(), H5F_ACC_TRUNC, creation.get(), access.get()), H5Fclose);
  if (file && H5Fset_dset_no_attrs_hint(file.get(), true) < 0) return {};  // 60 bytes less for each dataset
  return file;
}

Hdf5Handle create_group(const Hdf5Handle& file, const char* name) {
  const Hdf5Handle creation(H5Pcreate(H5P_GROUP_CREATE), H5Pclose);
  if (H5Pset_obj_track_times(creation.get(), false) < 0 ||
      H5Pset_attr_phase_change(creation.get(), kManyEntries, 0) < 0 ||
      H5Pset_link_phase_change(creation.get(), kManyEntries, 0) < 0)
    return {};
  return {H5Gcreate2(file.get(), name, H5P_DEFAULT, creation.get(), H5P_DEFAULT), H5Gclose};
}

bool put_attribute(const Hdf5Handle& object, const char* name, hid_t type, const Hdf5Handle& space,
                   const void* data) {
  const Hdf5Handle attribute(H5Acreate2(object.get(), name, type, space.get(), H5P_DEFAULT, H5P_DEFAULT),
                             H5Aclose);
  return attribute && H5Awrite(attribute.get(), type, data) >= 0;
}

bool put_text(const Hdf5Handle& object, const char* name, std::string text) {
  if (text.empty()) text.push_back('\0');  // HDF5 has no strings of length 0
  const Hdf5Handle type(H5Tcopy(H5T_C_S1), H5Tclose);
  const Hdf5Handle space(H5Screate(H5S_SCALAR), H5Sclose);
  return H5Tset_size(type.get(), text.size()) >= 0 && H5Tset_cset(type.get(), H5T_CSET_UTF8) >= 0 &&
         H5Tset_strpad(type.get(), H5T_STR_NULLPAD) >= 0 &&
         put_attribute(object, name, type.get(), space, text.data());
}

bool put_number(const Hdf5Handle& object, const ArraySpec& spec, const Bytes& data) {
  const hsize_t count = spec.columns;
  const Hdf5Handle space(count == 1 ? H5Screate(H5S_SCALAR) : H5Screate_simple(1, &count, nullptr), H5Sclose);
  return put_attribute(object, spec.name, hdf5_type(spec.element), space, data.data());
}

bool put_table(const Hdf5Handle& group, const ArraySpec& spec, const Bytes& data) {
  if (data.empty()) return true;
  const hsize_t shape[2] = {data.size() / (element_bytes(spec.element) * spec.columns), spec.columns};
  const int rank = spec.columns == 1 ? 1 : 2;
  const Hdf5Handle space(H5Screate_simple(rank, shape, nullptr), H5Sclose);
  const Hdf5Handle creation(H5Pcreate(H5P_DATASET_CREATE), H5Pclose);
  const bool set =
      H5Pset_obj_track_times(creation.get(), false) >= 0 && H5Pset_chunk(creation.get(), rank, shape) >= 0 &&
      (element_bytes(spec.element) == 1 || H5Pset_shuffle(creation.get()) >= 0) &&
      H5Pset_deflate(creation.get(), kDeflateLevel) >= 0 && H5Pset_fletcher32(creation.get()) >= 0 &&
      H5Pset_fill_time(creation.get(), H5D_FILL_TIME_NEVER) >= 0;
  if (!set) return false;
  const hid_t type = hdf5_type(spec.element);
  const Hdf5Handle dataset(
      H5Dcreate2(group.get(), spec.name, type, space.get(), H5P_DEFAULT, creation.get(), H5P_DEFAULT),
      H5Dclose);
  return dataset && H5Dwrite(dataset.get(), type, H5S_ALL, H5S_ALL, H5P_DEFAULT, data.data()) >= 0;
}

bool put_document(const Hdf5Handle& file, const Document& document) {
  const Hdf5Handle mesh = create_group(file, "mesh"), parts = create_group(file, "parts"),
                   maps = create_group(file, "maps");
  if (!mesh || !parts || !maps) return false;
  const auto owner = [&](const ArraySpec& spec) -> const Hdf5Handle& {
    const std::string group = spec.group;
    return group == "mesh" ? mesh : group == "parts" ? parts : group == "maps" ? maps : file;
  };
  for (std::size_t id = 0; id < kTextCount; ++id)
    if (!put_text(file, kTexts[id], document.text[id])) return false;
  if (!put_text(file, kContentHashName, content_hash(document))) return false;
  for (std::size_t id = 0; id < kNumberCount; ++id)
    if (!put_number(owner(kNumbers[id]), kNumbers[id], document.numbers[id])) return false;
  for (std::size_t id = 0; id < kTableCount; ++id)
    if (!put_table(owner(kTables[id]), kTables[id], document.tables[id])) return false;
  return true;
}

}  // namespace

Result<std::vector<std::uint8_t>> encode(const Asset& asset) {
  if (const auto findings = validate(asset, CheckLevel::kFull); !findings.empty())
    return Error{Status::kInvalidAsset,
                 "rule " + std::to_string(findings.front().rule) + ": " + findings.front().message,
                 "nothing was written; this is a defect of the program that made the asset"};
  const Document document = to_document(asset);

  const Hdf5Session session;
  Bytes image;
  Hdf5Handle file = create_file(session.unique_name(), image);
  const bool complete = file && put_document(file, document);
  if (!file.reset() || !complete || image.size() < kEofAt + 8)
    return Error{Status::kInvalidAsset, "HDF5 could not build the bundle in memory",
                 "free memory and try again"};
  std::uint64_t end;  // the image grows in steps of kGrowBytes; the file ends where its superblock says
  std::memcpy(&end, image.data() + kEofAt, sizeof end);
  image.resize(end);
  seal(image, minor_version(asset));
  return image;
}

Outcome write(const Asset& asset, const std::filesystem::path& path) {
  const auto bytes = encode(asset);
  if (!bytes) return bytes.error();
  return replace_file(path, bytes.value());
}

}  // namespace sqmap::io

// SPDX-License-Identifier: Apache-2.0
//
// Bundles made to harm: correct header and digest, and behind them what HDF5 allows and a bundle must not
// have.
#include <algorithm>
#include <cstring>
#include <functional>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <hdf5.h>
#include <zlib.h>

#include "sqmap/io/bundle.hpp"

#include "../../formats/src/hdf5_handle.hpp"
#include "../../formats/src/tables.hpp"
#include "formats/bundle_bytes.hpp"
#include "support/asset_builder.hpp"

// HDF5 1.10 loses memory of its own on damaged files. Identifiers that the reader loses are counted below.
extern "C" [[gnu::visibility("default")]] const char* __lsan_default_suppressions();
extern "C" const char* __lsan_default_suppressions() { return "leak:libhdf5"; }

namespace sqmap {
namespace {

using io::Hdf5Handle;
using test::Bytes;
using test::rich_asset;

// It would report the same on stderr when the program ends.
const herr_t kQuietExit = H5dont_atexit();

using Edit = std::function<void(hid_t)>;

/// The bundle of rich_asset() after `edit` had its way with the open file through HDF5, resealed.
Bytes forged(const Edit& edit) {
  const test::TemporaryFolder folder;
  const std::string path = folder.path() + "/forged.h5";
  test::store(path, io::encode(rich_asset()).value());
  const Hdf5Handle access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose);
  H5Pset_libver_bounds(access.get(), H5F_LIBVER_V110, H5F_LIBVER_V110);
  Hdf5Handle file(H5Fopen(path.c_str(), H5F_ACC_RDWR, access.get()), H5Fclose);
  EXPECT_TRUE(file);
  edit(file.get());
  EXPECT_TRUE(file.reset());
  Bytes bytes = test::load(path);
  test::reseal(bytes);
  return bytes;
}

/// The error that decode() gives; empty where it gives none.
std::string finding(const Bytes& bytes) {
  const auto decoded = io::decode(bytes);
  return decoded ? "" : decoded.error().finding;
}

void expect_refused(const std::string& fragment, const Edit& edit) {
  const std::string found = finding(forged(edit));
  EXPECT_NE(found.find(fragment), std::string::npos) << "expected: " << fragment << "\nfound: " << found;
}

using Shape = std::vector<hsize_t>;
const Shape kCodeShape{17 * 32 + 9 * 12 + 3 * 4};

/// Puts another dataset in the place of one: created with what `prepare` sets, then handed to `fill`.
void replace(
    hid_t file, const char* path, hid_t type, const Shape& shape, const Edit& prepare,
    const Edit& fill = [](hid_t) {}) {
  EXPECT_GE(H5Ldelete(file, path, H5P_DEFAULT), 0);
  const Hdf5Handle creation(H5Pcreate(H5P_DATASET_CREATE), H5Pclose);
  prepare(creation.get());
  const Hdf5Handle space(H5Screate_simple(static_cast<int>(shape.size()), shape.data(), nullptr), H5Sclose);
  const Hdf5Handle dataset(
      H5Dcreate2(file, path, type, space.get(), H5P_DEFAULT, creation.get(), H5P_DEFAULT), H5Dclose);
  EXPECT_TRUE(dataset) << path;
  fill(dataset.get());
}

void replace_code(hid_t file, const Edit& prepare) {
  replace(file, "/maps/code", H5T_STD_U16LE, kCodeShape, prepare);
}

Edit chunked(const Shape& shape) {
  return [shape](hid_t creation) {
    H5Pset_chunk(creation, static_cast<int>(shape.size()), shape.data());
    H5Pset_shuffle(creation);
    H5Pset_deflate(creation, 9);
    H5Pset_fletcher32(creation);
  };
}

/// HDF5's id for filters under test; nothing in HDF5 or here knows it.
constexpr H5Z_filter_t kStrangeFilter = 300;

/// Puts the filter in line while it is registered with HDF5, as a plugin would be.
Edit with_strange_filter(const Edit& prepare) {
  return [prepare](hid_t file) {
    const H5Z_class2_t dummy{H5Z_CLASS_T_VERS,
                             kStrangeFilter,
                             1,
                             1,
                             "dummy",
                             nullptr,
                             nullptr,
                             [](unsigned, std::size_t, const unsigned*, std::size_t bytes, std::size_t*,
                                void**) { return bytes; }};
    EXPECT_GE(H5Zregister(&dummy), 0);
    replace(file, "/maps/code", H5T_STD_U16LE, kCodeShape, prepare, [](hid_t dataset) {
      const std::vector<std::uint16_t> codes(kCodeShape[0]);
      EXPECT_GE(H5Dwrite(dataset, H5T_NATIVE_UINT16, H5S_ALL, H5S_ALL, H5P_DEFAULT, codes.data()), 0);
    });
    H5Fflush(file, H5F_SCOPE_LOCAL);
    EXPECT_GE(H5Zunregister(kStrangeFilter), 0);
  };
}

/// A chunk that inflates to `size` zeros, whatever the dataset declares.
Edit chunk_of_zeros(std::size_t size) {
  return [size](hid_t dataset) {
    const Bytes zeros(size);
    uLongf packed_size = compressBound(size);
    Bytes packed(packed_size + 4);  // room for a checksum
    EXPECT_EQ(compress2(packed.data(), &packed_size, zeros.data(), size, 9), Z_OK);
    const hsize_t origin[2] = {0, 0};
    EXPECT_GE(H5Dwrite_chunk(dataset, H5P_DEFAULT, 0, origin, packed_size + 4, packed.data()), 0);
  };
}

// The other tests of this file would pass for any damage if resealing did not work.
TEST(Hostile, ResealedBundleIsAccepted) {
  EXPECT_EQ(finding(forged([](hid_t) {})), "");
}

TEST(Hostile, ResealedBitFlipsAreErrorsOrChangeNothing) {
  const Bytes bytes = io::encode(rich_asset()).value();
  std::mt19937_64 random(2);
  int refused = 0;
  for (int i = 0; i < 1000; ++i) {
    Bytes damaged = bytes;
    const std::size_t bit = std::size_t{8} * 512 + random() % (8 * (bytes.size() - 512));
    damaged[bit / 8] ^= static_cast<std::uint8_t>(1U << (bit % 8));
    test::reseal(damaged);
    const auto decoded = io::decode(damaged);
    refused += !decoded;
    ASSERT_TRUE(!decoded || test::identical(decoded.value(), rich_asset())) << "bit " << bit;
  }
  EXPECT_GT(refused, 500) << "flips no longer reach what matters";
  EXPECT_EQ(H5Fget_obj_count(static_cast<hid_t>(H5F_OBJ_ALL), H5F_OBJ_ALL), 0) << "identifiers left open";
}

// A Document is what has passed the hashes: its arrays may still say anything.
TEST(Hostile, BoundsThatDoNotAddUpAreRefused) {
  const io::Document valid = io::to_document(test::bounded_asset());
  ASSERT_TRUE(io::to_asset(valid));
  const auto finding_of = [&](const std::function<void(io::Document&)>& edit) {
    io::Document document = valid;
    edit(document);
    const auto asset = io::to_asset(document);
    return asset ? "" : asset.error().finding;
  };
  const auto cells = [](std::uint32_t value) {
    return [value](io::Document& document) {
      std::memcpy(document.tables[io::kBoundCells].data(), &value, sizeof value);
    };
  };
  for (const std::uint32_t value : {4U, 0U, 65535U, 65536U, 0xFFFFFFFFU})
    EXPECT_NE(finding_of(cells(value)).find("/maps/bounds\""), std::string::npos) << value;
  for (const io::TableId id : {io::kBoundCells, io::kBoundTolerance, io::kBounds}) {
    EXPECT_NE(finding_of([&](io::Document& document) { document.tables[id].clear(); }).find("/maps/bound"),
              std::string::npos);
    EXPECT_NE(finding_of([&](io::Document& document) {
                document.tables[id].resize(2 * document.tables[id].size());
              }).find("/maps/bound"),
              std::string::npos);
  }
}

TEST(Hostile, TapersAndBendsThatDoNotAddUpAreRefused) {
  const io::Document valid = io::to_document(test::bent_asset());
  ASSERT_TRUE(io::to_asset(valid));
  for (const auto& [id, path] :
       {std::pair{io::kTaper, "/parts/taper\""}, {io::kBend, "/parts/bend_per_m\""}}) {
    for (const std::size_t bytes : {16U, 32U, 64U}) {
      io::Document document = valid;
      document.tables[id].resize(bytes);
      const auto asset = io::to_asset(document);
      ASSERT_FALSE(asset);
      EXPECT_NE(asset.error().finding.find(path), std::string::npos) << asset.error().finding;
    }
  }
  io::Document rigid = valid;
  rigid.tables[io::kTaper].clear();
  rigid.tables[io::kBend].clear();
  EXPECT_EQ(io::to_asset(rigid).value().parts[2].shape.taper, 0);
  EXPECT_TRUE(io::to_asset(rigid).value().parts[2].shape.bend.is_none());
}

/// Length and digests as they would be had the file been made like this.
Bytes resealed(Bytes bytes) {
  const std::uint64_t length = bytes.size();
  constexpr std::size_t kEndOfFileAt = 512 + 28;  // of the superblock
  if (bytes.size() >= kEndOfFileAt + 8) std::memcpy(bytes.data() + kEndOfFileAt, &length, 8);
  test::reseal(bytes);
  return bytes;
}

TEST(Hostile, EveryResealedTruncationIsAnError) {
  const Bytes bytes = io::encode(rich_asset()).value();
  ASSERT_EQ(finding(resealed(bytes)), "");
  for (std::size_t size = 512; size < bytes.size(); ++size) {
    Bytes cut(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(size));
    ASSERT_NE(finding(resealed(std::move(cut))), "") << size << " bytes";
  }
}

TEST(Hostile, ConcatenationsAreRefusedOrGiveTheFirst) {
  const Bytes one = io::encode(rich_asset()).value();
  Asset other = rich_asset();
  other.parts.resize(2);
  other.face_labels.assign(8, 0);
  const Bytes two = io::encode(other).value();
  for (const auto& [first, second] : {std::pair{&one, &two}, {&two, &one}, {&one, &one}}) {
    Bytes both = *first;
    both.insert(both.end(), second->begin(), second->end());
    EXPECT_NE(finding(both), "") << "without a new seal";
    const auto decoded = io::decode(resealed(both));
    const Asset& expected = first == &one ? rich_asset() : other;
    EXPECT_TRUE(!decoded || test::identical(decoded.value(), expected));
  }
}

TEST(Hostile, SwappedDatasetsAreRefused) {
  const std::pair<const char*, const char*> pairs[] = {
      {"/parts/vertex_count", "/parts/face_count"},    // alike in type and shape: only the content hash tells
      {"/parts/semi_axes_m", "/parts/translation_m"},  //
      {"/maps/crossing_code", "/maps/vertex_code"},    // other lengths
      {"/parts/segment", "/parts/volume_m3"},          // another type
      {"/maps/crossing_texel", "/maps/vertex_position"}  //
  };
  for (const auto& [a, b] : pairs) {
    const std::string found = finding(forged([a = a, b = b](hid_t file) {
      H5Lmove(file, a, file, "/elsewhere", H5P_DEFAULT, H5P_DEFAULT);
      H5Lmove(file, b, file, a, H5P_DEFAULT, H5P_DEFAULT);
      EXPECT_GE(H5Lmove(file, "/elsewhere", file, b, H5P_DEFAULT, H5P_DEFAULT), 0);
    }));
    EXPECT_NE(found, "") << a << ' ' << b;
  }
}

TEST(Hostile, GroupsAndDatasetsInEachOthersPlaceAreRefused) {
  expect_refused("\"/parts\"", [](hid_t file) {
    H5Lmove(file, "/parts", file, "/other", H5P_DEFAULT, H5P_DEFAULT);
    EXPECT_GE(H5Lcreate_hard(file, "/face_labels", file, "/parts", H5P_DEFAULT, H5P_DEFAULT), 0);
  });
  expect_refused("\"/face_labels\"", [](hid_t file) {
    H5Ldelete(file, "/face_labels", H5P_DEFAULT);
    EXPECT_TRUE(
        Hdf5Handle(H5Gcreate2(file, "/face_labels", H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT), H5Gclose));
  });
}

TEST(Hostile, LinksAndAttributesOutsideOfTheHeaderAreRefused) {
  // Beyond the limits of its creation a group moves its links to a heap, an object its attributes.
  expect_refused("outside of its header", [](hid_t file) {
    for (int k = 0; k < 300; ++k) {
      const std::string name = "/maps/more_" + std::to_string(k);
      H5Lcreate_hard(file, "/maps/code", file, name.c_str(), H5P_DEFAULT, H5P_DEFAULT);
    }
  });
  expect_refused("outside of its header", [](hid_t file) {
    const Hdf5Handle space(H5Screate(H5S_SCALAR), H5Sclose);
    for (int k = 0; k < 300; ++k) {
      const std::string name = "more_" + std::to_string(k);
      const Hdf5Handle attribute(
          H5Acreate2(file, name.c_str(), H5T_STD_U8LE, space.get(), H5P_DEFAULT, H5P_DEFAULT), H5Aclose);
    }
  });
}

TEST(Hostile, NamesThatTheFormatDoesNotKnowAreIgnored) {
  EXPECT_EQ(finding(forged([](hid_t file) {
              const Hdf5Handle group(H5Gcreate2(file, "/more", H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT),
                                     H5Gclose);
              const Hdf5Handle space(H5Screate(H5S_SCALAR), H5Sclose);
              const Hdf5Handle attribute(
                  H5Acreate2(file, "more", H5T_STD_U8LE, space.get(), H5P_DEFAULT, H5P_DEFAULT), H5Aclose);
              EXPECT_TRUE(group && attribute);
            })),
            "");
}

// Continuation blocks that lead back to themselves, in the words of the file format.
TEST(Hostile, HeadersWithoutEndAreRefused) {
  Bytes bytes = io::encode(rich_asset()).value();
  const std::string block = "OCHK";
  const auto at = std::search(bytes.begin() + 512, bytes.end(), block.begin(), block.end());
  ASSERT_NE(at, bytes.end());
  const auto here = static_cast<std::uint64_t>(at - bytes.begin()) - 512, size = std::uint64_t{28};
  const std::uint8_t message[4] = {0x10, 16, 0, 0};  // continuation of 16 bytes: address, length
  std::copy(std::begin(message), std::end(message), at + 4);
  std::memcpy(&*at + 8, &here, 8);
  std::memcpy(&*at + 16, &size, 8);
  const std::string found = finding(resealed(bytes));
  EXPECT_NE(found.find("continues in a block that is not in the file"), std::string::npos) << found;
}

TEST(Hostile, SoftLinksAreRefused) {
  expect_refused("\"/maps/code\": is a soft", [](hid_t file) {
    H5Lmove(file, "/maps/code", file, "/elsewhere", H5P_DEFAULT, H5P_DEFAULT);
    EXPECT_GE(H5Lcreate_soft("/elsewhere", file, "/maps/code", H5P_DEFAULT, H5P_DEFAULT), 0);
  });
}

TEST(Hostile, ExternalLinksAreRefused) {
  expect_refused("\"/maps/code\": is a soft, external", [](hid_t file) {
    H5Ldelete(file, "/maps/code", H5P_DEFAULT);
    EXPECT_GE(H5Lcreate_external("other.h5", "/secret", file, "/maps/code", H5P_DEFAULT, H5P_DEFAULT), 0);
  });
  expect_refused("group \"/parts\"", [](hid_t file) {
    H5Ldelete(file, "/parts", H5P_DEFAULT);
    EXPECT_GE(H5Lcreate_external("other.h5", "/parts", file, "/parts", H5P_DEFAULT, H5P_DEFAULT), 0);
  });
}

TEST(Hostile, ExternalStorageIsRefused) {
  expect_refused("must be stored inside the file", [](hid_t file) {
    replace_code(file, [](hid_t creation) {
      EXPECT_GE(H5Pset_external(creation, "/etc/passwd", 0, 2 * kCodeShape[0]), 0);
    });
  });
}

TEST(Hostile, VirtualDatasetsAreRefused) {
  expect_refused("must be stored inside the file", [](hid_t file) {
    replace_code(file, [](hid_t creation) {
      const Hdf5Handle space(H5Screate_simple(1, kCodeShape.data(), nullptr), H5Sclose);
      EXPECT_GE(H5Pset_virtual(creation, space.get(), "other.h5", "/secret", space.get()), 0);
    });
  });
}

TEST(Hostile, OtherLayoutsAreRefused) {
  expect_refused("as one chunk", [](hid_t file) { replace_code(file, [](hid_t) {}); });
  expect_refused("as one chunk", [](hid_t file) { replace_code(file, chunked({8})); });
}

TEST(Hostile, OtherFiltersAreRefused) {
  expect_refused("filters", [](hid_t file) {
    replace_code(file, [](hid_t creation) {
      H5Pset_chunk(creation, 1, kCodeShape.data());
      H5Pset_deflate(creation, 9);
    });
  });
  expect_refused("filters", [](hid_t file) {
    replace_code(file, [](hid_t creation) {
      chunked(kCodeShape)(creation);
      EXPECT_GE(H5Pset_filter(creation, H5Z_FILTER_NBIT, H5Z_FLAG_OPTIONAL, 0, nullptr), 0);
    });
  });
}

TEST(Hostile, FiltersThatHdf5DoesNotKnowAreRefused) {
  const auto add_strange = [](hid_t creation) {
    EXPECT_GE(H5Pset_filter(creation, kStrangeFilter, H5Z_FLAG_MANDATORY, 0, nullptr), 0);
  };
  expect_refused("filters", with_strange_filter([&](hid_t creation) {  // on top of those required
                   chunked(kCodeShape)(creation);
                   add_strange(creation);
                 }));
  expect_refused("filters", with_strange_filter([&](hid_t creation) {  // in the place of one
                   H5Pset_chunk(creation, 1, kCodeShape.data());
                   H5Pset_shuffle(creation);
                   add_strange(creation);
                   H5Pset_fletcher32(creation);
                 }));
}

TEST(Hostile, ChunksThatWentPastAFilterAreRefused) {
  const std::vector<std::uint16_t> codes(kCodeShape[0]);
  const auto store_past = [&](std::uint32_t skipped) {
    return [&codes, skipped](hid_t dataset) {
      const hsize_t origin = 0;
      EXPECT_GE(H5Dwrite_chunk(dataset, H5P_DEFAULT, skipped, &origin, 2 * codes.size(), codes.data()), 0);
    };
  };
  for (const std::uint32_t skipped : {1U, 2U, 4U, 7U})
    expect_refused("went past a filter", [&](hid_t file) {
      replace(file, "/maps/code", H5T_STD_U16LE, kCodeShape, chunked(kCodeShape), store_past(skipped));
    });
}

TEST(Hostile, OtherTypesAreRefused) {
  const char* kMessage = "is not of the type";
  expect_refused(kMessage, [](hid_t file) {
    replace(file, "/maps/code", H5T_STD_I16LE, kCodeShape, chunked(kCodeShape));
  });
  expect_refused(kMessage, [](hid_t file) {
    replace(file, "/parts/semi_axes_m", H5T_IEEE_F64BE, {3, 3}, chunked({3, 3}));
  });
  expect_refused(kMessage, [](hid_t file) {
    const Hdf5Handle type(H5Tvlen_create(H5T_STD_U16LE), H5Tclose);
    replace(file, "/maps/code", type.get(), kCodeShape,
            [](hid_t creation) { H5Pset_chunk(creation, 1, kCodeShape.data()); });
  });
}

TEST(Hostile, OtherShapesAreRefused) {
  expect_refused("must have the shape [rows]", [](hid_t file) {
    replace(file, "/maps/code", H5T_STD_U16LE, {2, 2}, chunked({2, 2}));
  });
  expect_refused("must have the shape [rows, 3]", [](hid_t file) {
    replace(file, "/parts/semi_axes_m", H5T_IEEE_F64LE, {3, 4}, chunked({3, 4}));
  });
  expect_refused("must have the shape [rows]", [](hid_t file) {
    const Shape deep(32, 1);
    replace(file, "/maps/code", H5T_STD_U16LE, deep, chunked(deep));
  });
}

TEST(Hostile, VariableLengthTextIsRefused) {
  expect_refused("\"source_name\": must be one string of fixed length", [](hid_t file) {
    H5Adelete(file, "source_name");
    const Hdf5Handle type(H5Tcopy(H5T_C_S1), H5Tclose);
    H5Tset_size(type.get(), H5T_VARIABLE);
    const Hdf5Handle space(H5Screate(H5S_SCALAR), H5Sclose);
    const Hdf5Handle attribute(
        H5Acreate2(file, "source_name", type.get(), space.get(), H5P_DEFAULT, H5P_DEFAULT), H5Aclose);
    const char* text = "x";
    EXPECT_GE(H5Awrite(attribute.get(), type.get(), &text), 0);
  });
}

TEST(Hostile, MissingDataIsNamed) {
  expect_refused("\"/r_max_m\": missing", [](hid_t file) { H5Adelete(file, "r_max_m"); });
  expect_refused("\"/parts/exponents\": missing",
                 [](hid_t file) { H5Ldelete(file, "/parts/exponents", H5P_DEFAULT); });
  expect_refused("group \"/mesh\": missing", [](hid_t file) { H5Ldelete(file, "/mesh", H5P_DEFAULT); });
}

// Sizes that a file declares are refused before memory is asked for.
TEST(Hostile, DeclaredSizesAreChecked) {
  const auto declare = [](hsize_t rows) {
    return [rows](hid_t file) {
      replace(file, "/maps/code", H5T_STD_U16LE, {rows}, chunked({rows}), chunk_of_zeros(64));
    };
  };
  expect_refused("exceeds the limit", declare(hsize_t{1} << 30));
  expect_refused("more than its", declare(hsize_t{100} << 20));
  expect_refused("a chunk that is not in the file",
                 [](hid_t file) { replace_code(file, chunked(kCodeShape)); });
}

TEST(Hostile, ChunksThatInflateToAnotherSizeAreRefused) {
  const auto inflate_to = [](std::size_t size) {
    return [size](hid_t file) {
      replace(file, "/maps/code", H5T_STD_U16LE, kCodeShape, chunked(kCodeShape), chunk_of_zeros(size));
    };
  };
  expect_refused("does not inflate to", inflate_to(std::size_t{8} << 20));
  expect_refused("does not inflate to", inflate_to(2 * kCodeShape[0] - 1));
  expect_refused("does not inflate to", inflate_to(0));
}

void overwrite(hid_t file, const char* path, const void* data) {
  const Hdf5Handle dataset(H5Dopen2(file, path, H5P_DEFAULT), H5Dclose);
  const Hdf5Handle type(H5Dget_type(dataset.get()), H5Tclose);
  EXPECT_GE(H5Dwrite(dataset.get(), type.get(), H5S_ALL, H5S_ALL, H5P_DEFAULT, data), 0);
}

void overwrite_text(hid_t file, const char* name, const std::string& text) {
  const Hdf5Handle attribute(H5Aopen(file, name, H5P_DEFAULT), H5Aclose);
  const Hdf5Handle type(H5Aget_type(attribute.get()), H5Tclose);
  EXPECT_GE(H5Awrite(attribute.get(), type.get(), text.data()), 0);
}

TEST(Hostile, ChangedContentIsRefusedByItsHash) {
  const std::uint16_t labels[8] = {0, 0, 1, kNoPart, 0, 2, 1, 1};
  expect_refused("content_hash", [&](hid_t file) { overwrite(file, "/face_labels", labels); });
  expect_refused("content_hash", [](hid_t file) { overwrite_text(file, "up_axis", "x"); });
}

// Header, digest, content hash and HDF5 are all in order; only the validator stands in between.
TEST(Hostile, BrokenRulesAreFoundBehindACorrectHash) {
  const auto forged_asset = [](Asset asset) {
    return forged([&](hid_t file) {
      const io::Document document = io::to_document(asset);
      overwrite(file, "/parts/exponents", document.tables[io::kExponents].data());
      overwrite(file, "/maps/crossing_texel", document.tables[io::kCrossingTexel].data());
      overwrite(file, "/face_labels", document.tables[io::kFaceLabels].data());
      overwrite_text(file, "content_hash", io::content_hash(document));
    });
  };
  EXPECT_EQ(finding(forged_asset(rich_asset())), "");
  const auto expect_rule = [&](const std::string& rule, const Asset& asset) {
    const std::string found = finding(forged_asset(asset));
    EXPECT_NE(found.find(rule), std::string::npos) << found;
  };
  Asset exponent = rich_asset();
  exponent.parts[1].shape.e2 = 1e300;
  expect_rule("rule 21", exponent);
  Asset texel = rich_asset();
  texel.parts[1].map.crossings[3].texel = 0xFFFFFFFF;
  expect_rule("rule 37", texel);
  Asset label = rich_asset();
  label.face_labels[0] = 3;
  expect_rule("rule 9", label);
}

// Map tables that do not add up to /maps/layout, with a correct hash.
TEST(Hostile, LayoutsThatDoNotAddUpAreRefused) {
  const auto expect_where = [](const std::string& where, std::size_t column, std::uint32_t value) {
    expect_refused(where, [&](hid_t file) {
      io::Document document = io::to_document(rich_asset());
      std::memcpy(document.tables[io::kLayout].data() + 4 * column, &value, 4);
      overwrite(file, "/maps/layout", document.tables[io::kLayout].data());
      overwrite_text(file, "content_hash", io::content_hash(document));
    });
  };
  expect_where("/maps/code", 0, 16);
  expect_where("/maps/layout", 0, 0xFFFFFFFF);
  expect_where("/maps/code", 1, 0);
  expect_where("rule 30", 2, 99);
  expect_where("/maps/layout", 3, 0);
  expect_where("/maps/code", 3, 4);  // its values have more bits
  expect_where("/maps/start_inside", 4, 1);
  expect_where("/maps/layout", 4, 2);
  expect_where("/maps/crossing_texel", 5, 0xFFFFFFFF);
  expect_where("/maps/vertex_cell", 6, 1);
}

}  // namespace
}  // namespace sqmap

// SPDX-License-Identifier: Apache-2.0
#include <chrono>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <string>

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include "sqmap/io/bundle.hpp"

#include "formats/bundle_bytes.hpp"
#include "support/asset_builder.hpp"

namespace sqmap {
namespace {

namespace fs = std::filesystem;
using test::rich_asset;

class BundleFile : public testing::Test {
 protected:
  std::string in_folder(const std::string& name) const { return folder_.path() + "/" + name; }
  std::size_t file_count() const {
    return static_cast<std::size_t>(
        std::distance(fs::directory_iterator(folder_.path()), fs::directory_iterator()));
  }
  static Status status_of(const Outcome& outcome) { return outcome ? Status{0} : outcome.error().status; }

  test::TemporaryFolder folder_;
};

TEST_F(BundleFile, HoldsTheEncodedBytesAndNothingElseIsLeft) {
  const std::string path = in_folder("a.h5");
  ASSERT_TRUE(io::write(rich_asset(), path));
  EXPECT_EQ(test::load(path), io::encode(rich_asset()).value());
  EXPECT_EQ(file_count(), 1u);
  const auto asset = io::read(path);
  ASSERT_TRUE(asset) << asset.error().finding;
  EXPECT_TRUE(test::identical(asset.value(), rich_asset()));
}

TEST_F(BundleFile, WritesIntoTheCurrentFolder) {
  const fs::path before = fs::current_path();
  fs::current_path(folder_.path());
  const bool written = io::write(rich_asset(), "plain.h5").ok();
  fs::current_path(before);
  EXPECT_TRUE(written);
  EXPECT_TRUE(fs::exists(in_folder("plain.h5")));
}

TEST_F(BundleFile, EqualContentIsLeftUntouched) {
  const std::string path = in_folder("a.h5");
  ASSERT_TRUE(io::write(rich_asset(), path));
  const auto old = fs::last_write_time(path) - std::chrono::hours(1);
  fs::last_write_time(path, old);
  ASSERT_TRUE(io::write(rich_asset(), path));
  EXPECT_EQ(fs::last_write_time(path), old);
  Asset other = rich_asset();
  other.mesh.faces = 6;  // same size, other bytes
  ASSERT_TRUE(io::write(other, path));
  EXPECT_NE(fs::last_write_time(path), old);
}

TEST_F(BundleFile, FullDiskLeavesTheOldFileAndNoTemporary) {
  const std::string path = in_folder("a.h5");
  test::store(path, {1, 2, 3});
  // A limit on file size ends a write in its middle, as a full disk does.
  rlimit old{};
  getrlimit(RLIMIT_FSIZE, &old);
  const auto handler = std::signal(SIGXFSZ, SIG_IGN);
  const rlimit tight{1000, old.rlim_max};
  setrlimit(RLIMIT_FSIZE, &tight);
  const auto outcome = io::write(rich_asset(), path);
  setrlimit(RLIMIT_FSIZE, &old);
  std::signal(SIGXFSZ, handler);
  ASSERT_FALSE(outcome);
  EXPECT_EQ(outcome.error().status, Status::kFileUnwritable);
  EXPECT_NE(outcome.error().finding.find("File too large"), std::string::npos) << outcome.error().finding;
  EXPECT_EQ(test::load(path), (test::Bytes{1, 2, 3}));
  EXPECT_EQ(file_count(), 1u);
}

TEST_F(BundleFile, DevicesAndFoldersAreNotReplaced) {
  EXPECT_EQ(status_of(io::write(rich_asset(), "/dev/full")), Status::kFileUnwritable);
  EXPECT_TRUE(fs::is_character_file("/dev/full"));
  EXPECT_EQ(status_of(io::write(rich_asset(), folder_.path())), Status::kFileUnwritable);
  EXPECT_EQ(status_of(io::write(rich_asset(), in_folder("missing/a.h5"))), Status::kFileUnwritable);
  EXPECT_EQ(file_count(), 0u);
}

TEST_F(BundleFile, SymbolicLinkStaysAndItsTargetIsReplaced) {
  test::store(in_folder("target.h5"), {1});
  fs::create_symlink("target.h5", in_folder("link.h5"));
  ASSERT_TRUE(io::write(rich_asset(), in_folder("link.h5")));
  EXPECT_TRUE(fs::is_symlink(in_folder("link.h5")));
  EXPECT_TRUE(io::read(in_folder("target.h5")));
  EXPECT_EQ(file_count(), 2u);
}

TEST_F(BundleFile, KeepsTheModeOfTheFileItReplaces) {
  const std::string path = in_folder("a.h5");
  test::store(path, {1});
  fs::permissions(path, fs::perms::owner_read | fs::perms::owner_write | fs::perms::group_read);
  ASSERT_TRUE(io::write(rich_asset(), path));
  EXPECT_EQ(fs::status(path).permissions(),
            fs::perms::owner_read | fs::perms::owner_write | fs::perms::group_read);
}

TEST_F(BundleFile, InvalidAssetWritesNothing) {
  Asset asset = rich_asset();
  asset.parts.clear();
  EXPECT_EQ(status_of(io::write(asset, in_folder("a.h5"))), Status::kInvalidAsset);
  EXPECT_EQ(file_count(), 0u);
}

TEST_F(BundleFile, ReadSaysWhatThePathIs) {
  const auto status = [](const fs::path& path) {
    const auto asset = io::read(path);
    return asset ? Status{0} : asset.error().status;
  };
  EXPECT_EQ(status(in_folder("missing.h5")), Status::kFileMissing);
  EXPECT_EQ(status(""), Status::kFileMissing);
  EXPECT_EQ(status(folder_.path()), Status::kFileUnreadable);
  ASSERT_EQ(mkfifo(in_folder("pipe").c_str(), 0600), 0);
  EXPECT_EQ(status(in_folder("pipe")), Status::kFileUnreadable);
  EXPECT_EQ(status("/dev/zero"), Status::kFileUnreadable);
  test::store(in_folder("empty.h5"), {});
  EXPECT_EQ(status(in_folder("empty.h5")), Status::kInvalidAsset);
}

TEST_F(BundleFile, HugeFileIsRefusedUnread) {
  const std::string path = in_folder("huge.h5");
  test::store(path, {1});
  fs::resize_file(path, std::uintmax_t{1} << 40);  // sparse
  const auto asset = io::read(path);
  ASSERT_FALSE(asset);
  EXPECT_EQ(asset.error().status, Status::kInvalidAsset);
  EXPECT_NE(asset.error().finding.find("1099511627776"), std::string::npos) << asset.error().finding;
}

}  // namespace
}  // namespace sqmap

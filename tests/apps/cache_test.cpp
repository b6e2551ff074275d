// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include "sqmap/io/bundle.hpp"

#include "../../apps/sqbake/cache/bundle_cache.hpp"
#include "../../apps/sqbake/cache/content_hash.hpp"
#include "../../apps/sqbake/cache/maintenance.hpp"
#include "support/analytic_asset.hpp"

namespace sqmap::apps {
namespace {

namespace fs = std::filesystem;

std::string text_of(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

void write_text(const fs::path& path, const std::string& text) {
  fs::create_directories(path.parent_path());
  std::ofstream(path, std::ios::binary | std::ios::trunc) << text;
}

std::string hash_of(const std::string& text) {
  return content_hash(std::span(reinterpret_cast<const std::uint8_t*>(text.data()), text.size()));
}

std::vector<fs::path> files_in(const fs::path& folder) {
  std::vector<fs::path> files;
  for (const auto& entry : fs::recursive_directory_iterator(folder))
    if (entry.is_regular_file()) files.push_back(entry.path());
  std::ranges::sort(files);
  return files;
}

bool mentions(const std::vector<std::string>& lines, const std::string& text) {
  return std::ranges::any_of(lines, [&](const std::string& line) { return line.find(text) != line.npos; });
}

class Cache : public testing::Test {
 protected:
  Cache() {
    std::string name = (fs::temp_directory_path() / "sqmap-cache-XXXXXX").string();
    folder_ = ::mkdtemp(name.data());
    write_text(mesh(), "a mesh");
  }
  ~Cache() override { fs::remove_all(folder_); }

  fs::path mesh() const { return folder_ / "in" / "a.off"; }
  fs::path output() const { return folder_ / "out" / "a.h5"; }
  fs::path store() const { return folder_ / "cache"; }
  BundleCache cache() const { return BundleCache(store()); }
  CacheRequest request() const {
    return {mesh(), output(), {R"({"fit":{"quick":false},"max_parts":24})", "algorithm-1"}};
  }

  /// Stands in for a bake: a bundle whose contents follow from the mesh and the options.
  static void bake(const CacheRequest& request) {
    Asset asset = test::ball_in_ellipsoid(0.5, 9, 16);
    asset.provenance.source_hash = hash_of(text_of(request.mesh));
    asset.provenance.options_json = request.identity.options_json;
    fs::create_directories(request.output.parent_path());
    const Outcome written = io::write(asset, request.output);
    ASSERT_TRUE(written) << written.error().finding;
  }

  /// Looks up, bakes and publishes on a miss. True: it was a hit.
  bool ask(const CacheRequest& request, const std::vector<fs::path>& side_files = {}) const {
    const CacheAnswer answer = cache().lookup(request);
    reasons_ = answer.reasons;
    output_written_ = answer.output_written;
    if (answer.is_hit) return true;
    bake(request);
    const Outcome stored = cache().publish(answer.ticket, side_files, R"({"parts":1})");
    EXPECT_TRUE(stored) << stored.error().finding;
    return false;
  }

  fs::path only_file(const std::string& kind) const {
    const auto files = files_in(store() / "v1" / kind);
    EXPECT_EQ(files.size(), 1U);
    return files.front();
  }

  fs::path folder_;
  mutable std::vector<std::string> reasons_;
  mutable bool output_written_ = false;
};

TEST_F(Cache, GivesBackTheBytesAndTheRecordOfTheBake) {
  EXPECT_FALSE(ask(request()));
  EXPECT_TRUE(mentions(reasons_, "no earlier bake"));
  const std::string cold = text_of(output());
  CacheRequest elsewhere = request();
  elsewhere.output = folder_ / "out" / "b.h5";
  const CacheAnswer answer = cache().lookup(elsewhere);
  ASSERT_TRUE(answer.is_hit);
  EXPECT_TRUE(answer.output_written);
  EXPECT_EQ(answer.record_json, R"({"parts":1})");
  EXPECT_EQ(text_of(elsewhere.output), cold);
}

TEST_F(Cache, LeavesAnOutputThatIsRightUntouched) {
  ask(request());
  const auto before = stamp_of(output());
  for (int i = 0; i < 3; ++i) {
    EXPECT_TRUE(ask(request()));
    EXPECT_FALSE(output_written_);
  }
  EXPECT_EQ(stamp_of(output()), before);
}

TEST_F(Cache, APeekAnswersAsALookupWouldAndWritesNothing) {
  const auto state = [this] {
    std::vector<std::pair<fs::path, std::optional<FileStamp>>> files;
    for (const fs::path& path : files_in(folder_)) files.emplace_back(path, stamp_of(path));
    return files;
  };
  const auto before = state();
  EXPECT_FALSE(cache().peek(request()).is_hit);
  EXPECT_EQ(state(), before);
  ask(request());
  fs::remove(output());
  const auto gone = state();
  const CacheAnswer held = cache().peek(request());
  EXPECT_TRUE(held.is_hit);
  EXPECT_FALSE(held.output_written);
  EXPECT_TRUE(mentions(held.reasons, "the cache has it"));
  EXPECT_EQ(state(), gone);
  EXPECT_TRUE(ask(request()));
  const CacheAnswer current = cache().peek(request());
  EXPECT_TRUE(current.is_hit);
  EXPECT_TRUE(mentions(current.reasons, "up to date"));

  write_text(mesh(), "another mesh");
  const CacheAnswer changed = cache().peek(request());
  EXPECT_FALSE(changed.is_hit);
  EXPECT_TRUE(mentions(changed.reasons, "mesh a.off changed"));
}

TEST_F(Cache, TouchingFilesChangesNothing) {
  ask(request());
  write_text(mesh(), text_of(mesh()));
  write_text(output(), text_of(output()));
  const auto before = stamp_of(output());
  EXPECT_TRUE(ask(request()));
  EXPECT_EQ(stamp_of(output()), before);
}

TEST_F(Cache, RestoresAnOutputThatIsGoneOrOther) {
  ask(request());
  const std::string cold = text_of(output());
  fs::remove(output());
  EXPECT_TRUE(ask(request()));
  EXPECT_TRUE(output_written_);
  EXPECT_EQ(text_of(output()), cold);
  std::string other = cold;
  other.back() = static_cast<char>(other.back() ^ 1);
  write_text(output(), other);
  EXPECT_TRUE(ask(request()));
  EXPECT_EQ(text_of(output()), cold);
}

TEST_F(Cache, AnyChangeOfTheMeshIsAMissThatNamesIt) {
  ask(request());
  write_text(mesh(), "b mesh");  // the same size, within the resolution of file times
  EXPECT_FALSE(ask(request()));
  EXPECT_TRUE(mentions(reasons_, "mesh a.off changed"));
  EXPECT_EQ(reasons_.size(), 1U);
  write_text(mesh(), "a mesh");
  EXPECT_TRUE(ask(request())) << "the first result is still there";
}

TEST_F(Cache, AChangedOptionIsAMissThatNamesItWithBothValues) {
  ask(request());
  CacheRequest other = request();
  other.identity.options_json = R"({"fit":{"quick":true},"max_parts":24})";
  EXPECT_FALSE(ask(other));
  EXPECT_EQ(reasons_, std::vector<std::string>{"option fit.quick: true, was false"});
  EXPECT_TRUE(ask(request()));
  EXPECT_TRUE(mentions(reasons_, "option fit.quick: false, was true"))
      << "the output is that of the other bake";
}

TEST_F(Cache, AnotherAlgorithmIsAMiss) {
  ask(request());
  CacheRequest other = request();
  other.identity.algorithm = "algorithm-2";
  EXPECT_FALSE(ask(other));
  EXPECT_EQ(reasons_, std::vector<std::string>{"algorithm algorithm-2, was algorithm-1"});
}

TEST_F(Cache, FoldersDecideNothingButTheMeshsNameDoes) {
  ask(request());
  CacheRequest moved = request();
  moved.mesh = folder_ / "else" / "where" / "a.off";
  moved.output = folder_ / "out" / "moved.h5";
  write_text(moved.mesh, text_of(mesh()));
  EXPECT_TRUE(ask(moved));
  CacheRequest renamed = moved;  // the bundle records the name, so its bytes differ
  renamed.mesh = folder_ / "in" / "b.off";
  write_text(renamed.mesh, text_of(mesh()));
  EXPECT_FALSE(ask(renamed));
}

TEST_F(Cache, SideFilesCountByContentAndSoDoesTheirAbsence) {
  const std::vector<fs::path> sides{mesh().parent_path() / "a.bin", mesh().parent_path() / "tex" / "a.mtl"};
  write_text(sides[0], "buffer");
  EXPECT_FALSE(ask(request(), sides));
  EXPECT_TRUE(ask(request(), sides));
  write_text(sides[0], "BUFFER");
  EXPECT_FALSE(ask(request(), sides));
  EXPECT_EQ(reasons_, std::vector<std::string>{"file a.bin changed"});
  write_text(sides[1], "was absent");
  EXPECT_FALSE(ask(request(), sides));
  EXPECT_EQ(reasons_, std::vector<std::string>{"file tex/a.mtl is new"});
  fs::remove(sides[1]);
  write_text(sides[0], "buffer");
  EXPECT_TRUE(ask(request(), sides));
}

TEST_F(Cache, DamagedBundlesAreMissesAndHeal) {
  ask(request());
  const std::string cold = text_of(output());
  for (const std::size_t at : {std::size_t{0}, cold.size() / 2, cold.size() - 1}) {
    std::string damaged = cold;
    damaged[at] = static_cast<char>(damaged[at] ^ 0x10);
    write_text(only_file("objects"), damaged);
    fs::remove(output());
    EXPECT_FALSE(ask(request()));
    EXPECT_TRUE(mentions(reasons_, "damaged"));
    fs::remove(output());
    EXPECT_TRUE(ask(request()));
    EXPECT_EQ(text_of(output()), cold);
  }
}

TEST_F(Cache, DamagedRecordsNeverGiveAWrongHit) {
  ask(request());
  const std::string cold = text_of(output());
  for (const char* kind : {"results", "outputs"}) {
    const fs::path file = only_file(kind);
    const std::string intact = text_of(file);
    for (std::size_t size = 0; size < intact.size(); size += 7) {
      write_text(file, intact.substr(0, size));
      const CacheAnswer answer = cache().lookup(request());
      EXPECT_EQ(answer.is_hit, std::string(kind) == "outputs") << kind << " cut to " << size;
      write_text(file, intact);
    }
    for (std::size_t at = 0; at < intact.size(); at += 3) {
      std::string damaged = intact;
      damaged[at] = static_cast<char>(damaged[at] ^ 0x5);
      write_text(file, damaged);
      const bool is_hit = cache().lookup(request()).is_hit;
      EXPECT_TRUE(!is_hit || text_of(output()) == cold) << kind << " byte " << at;
      write_text(file, intact);
    }
  }
}

TEST_F(Cache, NamesThatLeaveTheCacheAreDamage) {
  ask(request());
  const fs::path file = only_file("results");
  write_text(file, R"({"schema":"sqmap.cache-result/1","object":"../../../../../../../in/a.off"})");
  EXPECT_FALSE(cache().lookup(request()).is_hit);
  EXPECT_FALSE(fs::exists(file));
}

TEST_F(Cache, RefusesWhatChangedDuringTheBake) {
  const CacheAnswer answer = cache().lookup(request());
  write_text(mesh(), "another mesh");
  bake(request());
  EXPECT_FALSE(cache().publish(answer.ticket, {}, "{}"));
  write_text(mesh(), "a mesh");  // as at the lookup, but the bundle is still that of the other mesh
  EXPECT_FALSE(cache().publish(answer.ticket, {}, "{}"));
  write_text(mesh().parent_path() / "a.bin", "newer than the lookup");
  bake(request());
  EXPECT_FALSE(cache().publish(answer.ticket, std::vector{mesh().parent_path() / "a.bin"}, "{}"));
  EXPECT_FALSE(cache().lookup(request()).is_hit);
}

TEST_F(Cache, RefusesWhatIsNoBundle) {
  const CacheAnswer answer = cache().lookup(request());
  write_text(output(), "half a bundle");
  const Outcome stored = cache().publish(answer.ticket, {}, "{}");
  ASSERT_FALSE(stored);
  EXPECT_EQ(stored.error().status, Status::kInvalidAsset);
  bake(request());
  EXPECT_FALSE(cache().publish(answer.ticket, {}, "no object"));
}

TEST_F(Cache, AnUnusableFolderCostsTheHitAndNothingElse) {
  write_text(store(), "a file where the folder should be");
  const CacheAnswer answer = cache().lookup(request());
  EXPECT_FALSE(answer.is_hit);
  bake(request());
  const std::string baked = text_of(output());
  const Outcome stored = cache().publish(answer.ticket, {}, "{}");
  ASSERT_FALSE(stored);
  EXPECT_EQ(stored.error().status, Status::kFileUnwritable);
  EXPECT_EQ(text_of(output()), baked);
}

TEST_F(Cache, FilesGetTheModeThatTheUmaskSays) {
  const mode_t before = ::umask(0027);
  ask(request());
  fs::remove(output());
  ask(request());
  ::umask(before);
  std::vector<fs::path> files = files_in(store());
  files.push_back(output());
  for (const fs::path& file : files) EXPECT_EQ(fs::status(file).permissions(), fs::perms(0640)) << file;
}

TEST_F(Cache, SettledFilesAreNotReadAgain) {
  ask(request());
  // File times are trusted once they are two seconds old.
  std::this_thread::sleep_for(std::chrono::milliseconds(2100));
  EXPECT_TRUE(ask(request()));
  std::string record = text_of(only_file("outputs"));
  const std::string real = hash_of(text_of(mesh())), marked(32, '7');
  ASSERT_NE(record.find(real), record.npos);
  record.replace(record.find(real), 32, marked);
  write_text(only_file("outputs"), record);
  EXPECT_EQ(cache().lookup(request()).ticket.mesh_hash, marked) << "the mesh was read";
  fs::last_write_time(mesh(), fs::file_time_type::clock::now());
  EXPECT_EQ(cache().lookup(request()).ticket.mesh_hash, real);
}

TEST_F(Cache, ManyPublishersAndReadersNeverSeeHalfAnEntry) {
  bake(request());
  const std::string cold = text_of(output());
  std::atomic<int> hits{0}, wrong{0}, failed{0};
  std::vector<std::jthread> threads;
  for (int k = 0; k < 8; ++k) {
    threads.emplace_back([&, k] {
      CacheRequest own = request();
      own.output = folder_ / "out" / (std::to_string(k) + ".h5");
      for (int i = 0; i < 25; ++i) {
        fs::remove(own.output);
        CacheAnswer answer = cache().lookup(own);
        if (answer.is_hit) {
          ++hits;
          wrong += text_of(own.output) != cold;
        }
        bake(own);
        answer.ticket.request = own;
        failed += !cache().publish(answer.ticket, {}, R"({"parts":1})");
      }
    });
  }
  threads.clear();
  EXPECT_GT(hits, 100);
  EXPECT_EQ(wrong, 0);
  EXPECT_EQ(failed, 0);
  const auto verification = verify_cache(CacheStore(store()));
  ASSERT_TRUE(verification);
  EXPECT_TRUE(verification.value().damaged.empty());
  EXPECT_EQ(cache_statistics(CacheStore(store())).value().temporary_files, 0U);
}

TEST_F(Cache, VerifyFindsEveryDamageOnceAndRemovesIt) {
  for (const char* text : {"one", "two", "six"}) {
    write_text(mesh(), text);
    ask(request());
  }
  const auto objects = files_in(store() / "v1" / "objects");
  const auto results = files_in(store() / "v1" / "results");
  ASSERT_EQ(objects.size(), 3U);
  write_text(objects[0], text_of(objects[0]) + "x");
  write_text(results[1], "not a result");
  const auto found = verify_cache(CacheStore(store()));
  ASSERT_TRUE(found);
  // The damaged bundle, the damaged result, and the result whose bundle has just gone, unless it is that one.
  EXPECT_GE(found.value().damaged.size(), 2U);
  EXPECT_LE(found.value().damaged.size(), 3U);
  EXPECT_TRUE(verify_cache(CacheStore(store())).value().damaged.empty());
}

TEST_F(Cache, CollectionKeepsWhatWasUsedLast) {
  const auto an_hour = std::chrono::hours(1);
  const auto now = fs::file_time_type::clock::now();
  for (int i = 0; i < 6; ++i) {
    write_text(mesh(), "mesh " + std::to_string(i));
    ask(request());
  }
  const auto results = files_in(store() / "v1" / "results");
  ASSERT_EQ(results.size(), 6U);
  for (std::size_t i = 0; i < results.size(); ++i) fs::last_write_time(results[i], now - (10 - i) * an_hour);
  const CacheStore cache_store(store());
  const std::uint64_t all = cache_statistics(cache_store).value().bytes;

  const auto by_size = collect_cache(cache_store, {all * 6 / 10, std::nullopt});
  ASSERT_TRUE(by_size);
  EXPECT_EQ(by_size.value().removed_results, 3U);
  EXPECT_EQ(by_size.value().removed_objects, 3U);
  EXPECT_LE(cache_statistics(cache_store).value().bytes, all * 6 / 10);
  EXPECT_EQ(files_in(store() / "v1" / "results"), std::vector(results.begin() + 3, results.end()));

  const auto by_age = collect_cache(cache_store, {std::nullopt, std::chrono::minutes(6 * 60 + 30)});
  ASSERT_TRUE(by_age);
  EXPECT_EQ(files_in(store() / "v1" / "results"), std::vector(results.begin() + 4, results.end()));
  EXPECT_TRUE(verify_cache(cache_store).value().damaged.empty());
}

TEST_F(Cache, CollectionSparesWhatSomebodyMayBeWriting) {
  ask(request());
  const fs::path fresh = only_file("objects").parent_path() / ".sqmap-host-1-0.tmp";
  const fs::path stale = only_file("objects").parent_path() / ".sqmap-host-1-1.tmp";
  write_text(fresh, "");
  write_text(stale, "");
  fs::last_write_time(stale, fs::file_time_type::clock::now() - std::chrono::hours(2));
  const auto collected = collect_cache(CacheStore(store()), {});
  ASSERT_TRUE(collected);
  EXPECT_EQ(collected.value().removed_temporary_files, 1U);
  EXPECT_TRUE(fs::exists(fresh));
  EXPECT_TRUE(cache().lookup(request()).is_hit);
}

}  // namespace
}  // namespace sqmap::apps

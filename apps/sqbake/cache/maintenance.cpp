// SPDX-License-Identifier: GPL-3.0-or-later
#include "maintenance.hpp"

#include <algorithm>
#include <functional>
#include <map>
#include <set>
#include <system_error>
#include <utility>

#include <fmt/format.h>

#include "../../common/files.hpp"

namespace sqmap::apps {
namespace {

namespace fs = std::filesystem;
using std::chrono::seconds;

constexpr std::uint64_t kLargestText = std::uint64_t{16} << 20;
// Longer than any bake takes from its bundle to its record, with room for clocks that disagree.
constexpr seconds kGrace{3600};

struct StoredFile {
  fs::path path;
  std::string name;  ///< of the file: a hash
  std::uint64_t bytes;
  seconds age;
};

struct Inventory {
  std::vector<StoredFile> results, objects, outputs, temporary;

  std::uint64_t bytes() const {
    std::uint64_t sum = 0;
    for (const auto* files : {&results, &objects, &outputs, &temporary})
      for (const StoredFile& file : *files) sum += file.bytes;
    return sum;
  }
};

/// Files of one folder of shards, by name.
Outcome add_files(const fs::path& folder, std::vector<StoredFile>& files,
                  std::vector<StoredFile>& temporary) {
  std::error_code code;
  if (!fs::exists(folder, code)) return Done{};
  fs::recursive_directory_iterator entry(folder, code);
  for (; !code && entry != fs::recursive_directory_iterator(); entry.increment(code)) {
    const std::optional<FileStamp> stamp = stamp_of(entry->path());
    if (!stamp) continue;
    const std::string name = entry->path().filename().string();
    const seconds age{std::max<std::int64_t>(0, now_ns() - stamp->mtime_ns) / 1'000'000'000};
    if (is_content_hash(name)) files.push_back({entry->path(), name, stamp->size, age});
    if (name.starts_with(kTemporaryPrefix)) temporary.push_back({entry->path(), name, stamp->size, age});
  }
  if (code)
    return Error{Status::kFileUnreadable, fmt::format("{}: {}", folder.string(), code.message()),
                 "check the permissions of the cache folder"};
  std::ranges::sort(files, {}, &StoredFile::name);
  return Done{};
}

Result<Inventory> take_inventory(const CacheStore& store) {
  std::error_code code;
  if (!fs::is_directory(store.folder(), code))
    return Error{Status::kFileMissing, fmt::format("{}: no such folder", store.folder().string()),
                 "name the cache with --cache or SQMAP_CACHE_DIR; a bake makes it"};
  Inventory inventory;
  if (const Outcome ok = add_files(store.results(), inventory.results, inventory.temporary); !ok)
    return ok.error();
  if (const Outcome ok = add_files(store.objects(), inventory.objects, inventory.temporary); !ok)
    return ok.error();
  if (const Outcome ok = add_files(store.outputs(), inventory.outputs, inventory.temporary); !ok)
    return ok.error();
  return inventory;
}

enum class Removal { kDone, kVanished, kRefused };

Removal removal_of(const StoredFile& file) {
  std::error_code code;
  if (fs::remove(file.path, code)) return Removal::kDone;
  return code ? Removal::kRefused : Removal::kVanished;
}

/// Removes files that `condition` picks; the number of them. Adds those that stay to `refused`.
template <class Condition>
std::uint64_t remove_if(std::vector<StoredFile>& files, std::uint64_t& refused, Condition condition) {
  return std::erase_if(files, [&](const StoredFile& file) {
    if (!condition(file)) return false;
    const Removal removal = removal_of(file);
    if (removal == Removal::kRefused) ++refused;
    return removal == Removal::kDone;
  });
}

/// The object a result names; empty for one that leads to side files or is damaged.
std::string object_named_by(const StoredFile& result) {
  const Result<std::vector<std::uint8_t>> bytes = read_file(result.path, kLargestText);
  if (!bytes) return "";
  const std::optional<CacheResult> parsed = parse_result(bytes.value());
  return parsed ? parsed->object : "";
}

/// Removes the longest unused results until the rest and what they name fits.
std::uint64_t remove_until_it_fits(Inventory& inventory, const std::map<std::string, std::string>& object_of,
                                   std::uint64_t max_bytes, std::uint64_t& refused) {
  std::map<std::string, std::uint64_t> object_bytes, users;
  for (const StoredFile& object : inventory.objects) object_bytes[object.name] = object.bytes;
  for (const StoredFile& result : inventory.results) ++users[object_of.at(result.name)];
  std::uint64_t total = inventory.bytes();
  std::ranges::stable_sort(inventory.results, std::greater<>(), &StoredFile::age);
  return remove_if(inventory.results, refused, [&](const StoredFile& result) {
    if (total <= max_bytes) return false;
    total -= result.bytes;
    const std::string& object = object_of.at(result.name);
    if (--users[object] == 0 && !object.empty()) total -= object_bytes[object];
    return true;
  });
}

/// Removes the notes on the longest untouched outputs until the rest fits: what else may go has gone.
std::uint64_t remove_outputs_until_it_fits(Inventory& inventory, std::uint64_t max_bytes,
                                           std::uint64_t& refused) {
  std::uint64_t total = inventory.bytes();
  std::ranges::stable_sort(inventory.outputs, std::greater<>(), &StoredFile::age);
  return remove_if(inventory.outputs, refused, [&](const StoredFile& output) {
    if (total <= max_bytes) return false;
    total -= output.bytes;
    return true;
  });
}

/// Removes bundles that no result names any more, and those that none ever named.
std::uint64_t remove_objects(Inventory& inventory, const std::map<std::string, std::string>& object_of,
                             std::uint64_t& refused) {
  std::set<std::string> named_before, named;
  for (const auto& [result, object] : object_of) named_before.insert(object);
  for (const StoredFile& result : inventory.results) named.insert(object_of.at(result.name));
  return remove_if(inventory.objects, refused, [&](const StoredFile& object) {
    return !named.contains(object.name) && (named_before.contains(object.name) || object.age > kGrace);
  });
}

}  // namespace

Result<CacheStatistics> cache_statistics(const CacheStore& store) {
  const Result<Inventory> inventory = take_inventory(store);
  if (!inventory) return inventory.error();
  const auto& [results, objects, outputs, temporary] = inventory.value();
  CacheStatistics statistics{
      results.size(), objects.size(), outputs.size(), inventory.value().bytes(), temporary.size(), {}, {}};
  if (!results.empty()) {
    const auto [newest, oldest] = std::ranges::minmax_element(results, {}, &StoredFile::age);
    statistics.oldest = oldest->age;
    statistics.newest = newest->age;
  }
  return statistics;
}

Result<CacheVerification> verify_cache(const CacheStore& store) {
  Result<Inventory> inventory = take_inventory(store);
  if (!inventory) return inventory.error();
  CacheVerification verification{inventory.value().results.size(), inventory.value().objects.size(), {}, 0};
  const auto report = [&](const StoredFile& file, std::string finding) {
    const Removal removal = removal_of(file);
    if (removal == Removal::kVanished) return;
    if (removal == Removal::kRefused) ++verification.refused;
    verification.damaged.push_back(std::move(finding));
  };
  std::set<std::string> intact;
  for (const StoredFile& object : inventory.value().objects) {
    const std::optional<HashedFile> file = hash_file(object.path);
    if (!file) continue;
    if (file->hash == object.name) {
      intact.insert(object.name);
    } else {
      report(object, fmt::format("bundle {}: its bytes have the hash {}", object.name, file->hash));
    }
  }
  for (const StoredFile& result : inventory.value().results) {
    const Result<std::vector<std::uint8_t>> bytes = read_file(result.path, kLargestText);
    if (!bytes) continue;
    const std::optional<CacheResult> parsed = parse_result(bytes.value());
    if (!parsed) {
      report(result, fmt::format("result {}: cannot be read", result.name));
    } else if (!parsed->object.empty() && !intact.contains(parsed->object) &&
               !stamp_of(store.objects() / parsed->object.substr(0, 2) / parsed->object)) {
      report(result, fmt::format("result {}: its bundle {} is missing", result.name, parsed->object));
    }
  }
  return verification;
}

Result<CacheCollection> collect_cache(const CacheStore& store, const CollectLimits& limits) {
  Result<Inventory> taken = take_inventory(store);
  if (!taken) return taken.error();
  Inventory& inventory = taken.value();
  CacheCollection collection;
  collection.bytes_before = inventory.bytes();
  std::uint64_t& refused = collection.refused;
  collection.removed_temporary_files =
      remove_if(inventory.temporary, refused, [](const StoredFile& file) { return file.age > kGrace; });
  std::map<std::string, std::string> object_of;  // by result
  for (const StoredFile& result : inventory.results) object_of[result.name] = object_named_by(result);
  if (limits.max_age) {
    const auto is_old = [&](const StoredFile& file) { return file.age > *limits.max_age; };
    collection.removed_results = remove_if(inventory.results, refused, is_old);
    collection.removed_outputs = remove_if(inventory.outputs, refused, is_old);
    collection.removed_objects = remove_objects(inventory, object_of, refused);
  }
  if (limits.max_bytes)
    collection.removed_results += remove_until_it_fits(inventory, object_of, *limits.max_bytes, refused);
  collection.removed_objects += remove_objects(inventory, object_of, refused);
  if (limits.max_bytes)
    collection.removed_outputs += remove_outputs_until_it_fits(inventory, *limits.max_bytes, refused);
  collection.bytes_after = inventory.bytes();
  return collection;
}

}  // namespace sqmap::apps

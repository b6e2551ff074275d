// SPDX-License-Identifier: GPL-3.0-or-later
#include <chrono>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "../../common/choices.hpp"
#include "../../common/json_text.hpp"
#include "../commands.hpp"
#include "../quantities.hpp"
#include "bundle_cache.hpp"
#include "maintenance.hpp"

namespace sqmap::apps {
namespace {

using Json = nlohmann::ordered_json;
using std::chrono::seconds;

constexpr double kSecondsPerDay = 86400;

struct CacheArguments {
  std::filesystem::path folder;
  std::string format = "text";
  CollectLimits limits;
};

std::string days(seconds age) {
  return fmt::format("{:.1f} days", static_cast<double>(age.count()) / kSecondsPerDay);
}

Json header(const CacheStore& store, const char* type) {
  return {{"schema", "sqmap.cache/1"}, {"type", type}, {"folder", store.folder().string()}};
}

Exit print_stats(Console& console, const CacheStore& store, const CacheArguments& arguments) {
  const Result<CacheStatistics> taken = cache_statistics(store);
  if (!taken) return refuse(console, store.folder().string(), taken.error());
  const CacheStatistics& statistics = taken.value();
  if (arguments.format == "json") {
    Json json = header(store, "stats");
    json["results"] = statistics.results;
    json["bundles"] = statistics.objects;
    json["outputs"] = statistics.outputs;
    json["temporary_files"] = statistics.temporary_files;
    json["bytes"] = statistics.bytes;
    json["oldest_s"] = statistics.oldest ? Json(statistics.oldest->count()) : Json();
    json["newest_s"] = statistics.newest ? Json(statistics.newest->count()) : Json();
    console.out(json_text(json));
    return Exit::kOk;
  }
  std::string text = fmt::format(
      "folder           {}\nresults          {}\nbundles          {}\noutputs          {}\n"
      "temporary files  {}\nbytes            {}\n",
      store.folder().string(), statistics.results, statistics.objects, statistics.outputs,
      statistics.temporary_files, statistics.bytes);
  if (statistics.oldest)
    text +=
        fmt::format("last used        {} to {} ago\n", days(*statistics.newest), days(*statistics.oldest));
  console.out(text);
  return Exit::kOk;
}

/// Files that could not be removed are there still, and so is the damage or the size.
Exit end_of(Console& console, const CacheStore& store, std::uint64_t refused, Exit otherwise) {
  if (refused == 0) return otherwise;
  return refuse(console, {Status::kFileUnwritable,
                          fmt::format("{}: {} {} could not be removed", store.folder().string(), refused,
                                      refused == 1 ? "file" : "files"),
                          "run it where the cache can be written"});
}

Exit print_verification(Console& console, const CacheStore& store, const CacheArguments& arguments) {
  const Result<CacheVerification> taken = verify_cache(store);
  if (!taken) return refuse(console, store.folder().string(), taken.error());
  const CacheVerification& verification = taken.value();
  if (arguments.format == "json") {
    Json json = header(store, "verify");
    json["results"] = verification.results;
    json["bundles"] = verification.objects;
    json["damaged"] = verification.damaged;
    console.out(json_text(json));
  } else {
    for (const std::string& line : verification.damaged) console.out(line + "\n");
    console.out(fmt::format("{} results, {} bundles; {} damaged{}\n", verification.results,
                            verification.objects, verification.damaged.size(),
                            verification.refused == 0 ? ", removed" : ""));
  }
  return end_of(console, store, verification.refused,
                verification.damaged.empty() ? Exit::kOk : Exit::kSomeFailed);
}

Exit print_collection(Console& console, const CacheStore& store, const CacheArguments& arguments) {
  const Result<CacheCollection> taken = collect_cache(store, arguments.limits);
  if (!taken) return refuse(console, store.folder().string(), taken.error());
  const CacheCollection& collection = taken.value();
  if (arguments.format == "json") {
    Json json = header(store, "gc");
    json["removed_results"] = collection.removed_results;
    json["removed_bundles"] = collection.removed_objects;
    json["removed_outputs"] = collection.removed_outputs;
    json["removed_temporary_files"] = collection.removed_temporary_files;
    json["bytes_before"] = collection.bytes_before;
    json["bytes_after"] = collection.bytes_after;
    console.out(json_text(json));
  } else {
    console.out(fmt::format("removed {} results, {} bundles, {} temporary files; {} bytes of {} remain\n",
                            collection.removed_results, collection.removed_objects,
                            collection.removed_temporary_files, collection.bytes_after,
                            collection.bytes_before));
  }
  return end_of(console, store, collection.refused, Exit::kOk);
}

void add_gc_options(CLI::App& gc, CollectLimits& limits) {
  gc.add_option_function<std::string>(
        "--max-size",
        [&limits](const std::string& text) {
          const Result<std::uint64_t> bytes = parse_bytes(text);
          if (!bytes) throw CLI::ValidationError("--max-size", bytes.error().finding);
          limits.max_bytes = bytes.value();
        },
        "Remove the longest unused until the rest fits; K and M are 1024 and\n1024 * 1024")
      ->type_name("BYTES");
  gc.add_option_function<double>(
        "--max-age",
        [&limits](const double& age_days) {
          limits.max_age = seconds(static_cast<std::int64_t>(age_days * kSecondsPerDay));
        },
        "Remove what was of no use for so many days")
      ->check(CLI::Range(0.0, 36500.0).description(""))
      ->type_name("DAYS");
}

}  // namespace

std::function<Exit(Console&)> declare_cache(CLI::App& app) {
  const auto args = std::make_shared<CacheArguments>();
  app.description(
      "Shows, checks or tidies the folder that finished bundles are kept in. `sqbake bake` fills it. A "
      "result\n"
      "is found by the bytes of the mesh and of every file it refers to, the options, and the algorithm.\n"
      "\n"
      "Examples:\n"
      "  sqbake cache stats\n"
      "  sqbake cache verify --cache /net/shared/sqmap\n"
      "  sqbake cache gc --max-size 500M --max-age 90\n");
  app.add_option("--cache", args->folder,
                 "Folder (default: SQMAP_CACHE_DIR, else sqmap in XDG_CACHE_HOME,\n"
                 "else ~/.cache/sqmap; none where SQMAP_CACHE_DIR is set to nothing)")
      ->type_name("DIR");
  add_words(app, "--format", args->format, {"text", "json"}, "text or json (default text)");
  CLI::App* stats = app.add_subcommand("stats", "How much is in it")->fallthrough();
  CLI::App* verify =
      app.add_subcommand("verify", "Read all of it; remove what is damaged, then exit 1")->fallthrough();
  CLI::App* gc = app.add_subcommand("gc", "Remove what is old or too much")->fallthrough();
  add_gc_options(*gc, args->limits);
  app.require_subcommand(1);
  return [args, stats, verify](Console& console) {
    std::optional<std::filesystem::path> folder = args->folder;
    if (folder->empty()) folder = BundleCache::default_folder();
    if (!folder) {
      console.error(
          "no cache folder: SQMAP_CACHE_DIR is set to nothing, or it, XDG_CACHE_HOME and HOME are unset; "
          "name "
          "one with --cache DIR");
      return Exit::kUsage;
    }
    const CacheStore store(*folder);
    if (stats->parsed()) return print_stats(console, store, *args);
    if (verify->parsed()) return print_verification(console, store, *args);
    return print_collection(console, store, *args);
  };
}

}  // namespace sqmap::apps

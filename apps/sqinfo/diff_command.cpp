// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "sqmap/io/bundle.hpp"

#include "../common/choices.hpp"
#include "../common/json_text.hpp"
#include "asset_diff.hpp"
#include "commands.hpp"

namespace sqmap::apps {
namespace {

struct DiffArguments {
  std::filesystem::path first, second;
  DiffOptions options;
  bool ignore_provenance = false;
  std::string format = "text";
};

std::string size_text(double size) { return std::isfinite(size) ? fmt::format("  (by {:.3g})", size) : ""; }

Exit run_diff(Console& console, const DiffArguments& arguments) {
  const Result<Asset> first = io::read(arguments.first);
  if (!first) return report(console, arguments.first, first.error());
  const Result<Asset> second = io::read(arguments.second);
  if (!second) return report(console, arguments.second, second.error());
  DiffOptions options = arguments.options;
  options.with_provenance = !arguments.ignore_provenance;
  const std::vector<Difference> found = differences(first.value(), second.value(), options);

  if (arguments.format == "json") {
    nlohmann::ordered_json json{{"schema", "sqmap.diff/1"},
                                {"first", arguments.first.string()},
                                {"second", arguments.second.string()},
                                {"tolerance", options.tolerance},
                                {"equal", found.empty()}};
    json["differences"] = nlohmann::ordered_json::array();
    for (const Difference& each : found)
      json["differences"].push_back(
          {{"where", each.where}, {"first", each.first}, {"second", each.second}, {"size", each.size}});
    console.out(json_text(json));
  } else {
    std::string text;
    for (const Difference& each : found)
      text += fmt::format("{}: {}{}{}{}\n", each.where, each.first, each.first.empty() ? "" : " -> ",
                          each.second, size_text(each.size));
    console.out(text);
  }
  return found.empty() ? Exit::kOk : Exit::kDifferent;
}

}  // namespace

std::function<Exit(Console&)> declare_diff(CLI::App& app) {
  const auto args = std::make_shared<DiffArguments>();
  app.description(
      "Compares what two bundles hold, part by part. Silent with exit code 0 when they are equal, one line "
      "a\n"
      "difference and exit code 7 when not.\n"
      "\n"
      "Examples:\n"
      "  sqinfo diff old.h5 new.h5\n"
      "  sqinfo diff old.h5 new.h5 --tolerance 1e-4 --ignore-provenance\n");
  app.add_option("FIRST", args->first, "Bundle file")->required();
  app.add_option("SECOND", args->second, "Bundle file")->required();
  app.add_option("--tolerance", args->options.tolerance,
                 "Largest difference that counts as none, lengths in units of R_max (default 0: bit for bit)")
      ->check(CLI::NonNegativeNumber.description(""))
      ->type_name("T");
  app.add_flag("--ignore-provenance", args->ignore_provenance,
               "Leave out program, version, options, and name and hash of the source");
  add_words(app, "--format", args->format, {"text", "json"}, "text or json (default text)");
  return [args](Console& console) { return run_diff(console, *args); };
}

}  // namespace sqmap::apps

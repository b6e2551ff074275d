// SPDX-License-Identifier: Apache-2.0
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "sqmap/asset/validate.hpp"
#include "sqmap/io/bundle.hpp"

#include "../common/choices.hpp"
#include "../common/json_text.hpp"
#include "commands.hpp"

namespace sqmap::apps {
namespace {

struct ValidateArguments {
  std::filesystem::path bundle;
  CheckLevel level = CheckLevel::kFull;
  std::string format = "text";
};

Exit run_validate(Console& console, const ValidateArguments& arguments) {
  const std::string path = arguments.bundle.string();
  const Result<Asset> asset = io::read(arguments.bundle);
  if (!asset && asset.error().status != Status::kInvalidAsset)
    return report(console, arguments.bundle, asset.error());
  std::vector<Finding> findings;
  if (asset) findings = validate(asset.value(), arguments.level);
  const bool is_valid = asset.ok() && findings.empty();

  if (arguments.format == "json") {
    nlohmann::ordered_json json{{"schema", "sqmap.validate/1"}, {"bundle", path}, {"valid", is_valid}};
    json["findings"] = nlohmann::ordered_json::array();
    if (!asset) json["findings"].push_back({{"rule", nullptr}, {"message", asset.error().finding}});
    for (const Finding& finding : findings)
      json["findings"].push_back({{"rule", finding.rule}, {"message", finding.message}});
    console.out(json_text(json));
    return is_valid ? Exit::kOk : Exit::kBadInput;
  }
  if (!asset) return report(console, arguments.bundle, asset.error());
  std::string text;
  for (const Finding& finding : findings)
    text += fmt::format("{}: rule {}: {}\n", path, finding.rule, finding.message);
  text +=
      is_valid ? fmt::format("{}: valid\n", path) : fmt::format("{}: {} findings\n", path, findings.size());
  console.out(text);
  return is_valid ? Exit::kOk : Exit::kBadInput;
}

}  // namespace

std::function<Exit(Console&)> declare_validate(CLI::App& app) {
  const auto args = std::make_shared<ValidateArguments>();
  app.description(
      "Checks a bundle: container and content hash, then every rule of formats/FORMAT.md. Exit code 0 when "
      "valid, 4\n"
      "when not; all findings go to stdout. What cannot be read at all has one finding, on stderr.\n"
      "\n"
      "Examples:\n"
      "  sqinfo validate hand.h5\n"
      "  sqinfo validate hand.h5 --level quick --format json\n");
  app.add_option("BUNDLE", args->bundle, "Bundle file")->required();
  add_choice<CheckLevel>(
      app, "--level", args->level, {{"quick", CheckLevel::kQuick}, {"full", CheckLevel::kFull}},
      "quick: what a reader must trust; full: also orders, codes and bounds (default full)");
  add_words(app, "--format", args->format, {"text", "json"}, "text or json (default text)");
  return [args](Console& console) { return run_validate(console, *args); };
}

}  // namespace sqmap::apps

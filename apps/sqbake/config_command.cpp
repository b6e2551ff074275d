// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "../common/choices.hpp"
#include "../common/json_text.hpp"
#include "commands.hpp"
#include "config_files.hpp"

namespace sqmap::apps {
namespace {

struct ConfigArguments {
  std::vector<std::filesystem::path> meshes;
  std::filesystem::path manifest;
  ConfigRequest request;
  std::string format = "text";
};

const ManifestAsset* asset_of(const Manifest& manifest, const std::filesystem::path& mesh) {
  std::error_code code;
  const auto entry = std::ranges::find_if(manifest.assets, [&](const ManifestAsset& asset) {
    return std::filesystem::equivalent(manifest.path.parent_path() / asset.input, mesh, code);
  });
  return entry == manifest.assets.end() ? nullptr : &*entry;
}

std::string text_report(const std::filesystem::path& mesh, const EffectiveSettings& effective) {
  std::size_t width = 0;
  for (const Setting& setting : all_settings())
    width = std::max(width, std::string_view(setting.name).size());
  std::string text = mesh.string() + "\n";
  for (const Setting& setting : all_settings()) {
    const SettingValue& value = effective.values.find(setting.name)->second;
    text += fmt::format("  {:<{}} {:<12} {}\n", setting.name, width, value.text, value.source);
  }
  return text;
}

std::string json_report(const std::filesystem::path& mesh, const EffectiveSettings& effective) {
  nlohmann::ordered_json json{{"schema", "sqmap.config/1"}, {"input", mesh.string()}};
  for (const Setting& setting : all_settings()) {
    const SettingValue& value = effective.values.find(setting.name)->second;
    json["settings"][setting.name] = {{"value", value.text}, {"source", value.source}};
  }
  return json_line(json);
}

Exit run_show(Console& console, const ConfigArguments& arguments) {
  std::optional<Manifest> manifest;
  if (!arguments.manifest.empty()) {
    Result<Manifest> read = read_manifest(arguments.manifest);
    if (!read) return refuse(console, read.error());
    manifest = std::move(read).value();
  }
  ConfigFiles files(arguments.request);
  for (const std::filesystem::path& mesh : arguments.meshes) {
    const ManifestAsset* asset = manifest ? asset_of(*manifest, mesh) : nullptr;
    const Result<EffectiveSettings> effective =
        files.settings_of(mesh, manifest ? &*manifest : nullptr, asset);
    if (!effective) return refuse(console, effective.error());
    if (const auto ok = options_from(texts_of(effective.value().values)); !ok)
      return refuse(console, ok.error());
    console.out(arguments.format == "text" ? text_report(mesh, effective.value())
                                           : json_report(mesh, effective.value()));
  }
  return Exit::kOk;
}

}  // namespace

std::function<Exit(Console&)> declare_config(CLI::App& app) {
  const auto args = std::make_shared<ConfigArguments>();
  app.description(
      "Shows the settings that `sqbake bake` would use for a mesh, and where each was given. The later wins: "
      "built\n"
      "in, [default] of sqbake.toml, [default] of the manifest, matching [[rule]]s of sqbake.toml in their "
      "order,\n"
      "the manifest's [[asset]], the sidecar, the command line.\n"
      "\n"
      "Examples:\n"
      "  sqbake config show models/hand.off\n"
      "  sqbake config show models/hand.off --max-error 0.1% --format json\n");
  app.require_subcommand(1);
  CLI::App* show = app.add_subcommand("show", "Print the settings of a mesh");
  show->add_option("MESH", args->meshes, "Mesh files; they need not exist")->required()->type_name("");
  show->add_option("--manifest", args->manifest, "As of `sqbake bake`")->type_name("FILE.toml");
  show->add_option("--config", args->request.project, "As of `sqbake bake`")->type_name("FILE.toml");
  show->add_flag("!--no-config", args->request.use_files, "As of `sqbake bake`");
  add_words(*show, "--format", args->format, {"text", "json"},
            "text or json, one line a mesh (default text)");
  add_all_setting_options(*show, args->request.command_line);
  return [args](Console& console) { return run_show(console, *args); };
}

}  // namespace sqmap::apps

// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <memory>
#include <string>

#include <CLI/CLI.hpp>

#include "commands.hpp"
#include "untrusted.hpp"

namespace sqmap::apps {

Exit report(Console& console, const std::filesystem::path& file, const Error& error) {
  console.error(message_for(file.string(), error));
  return exit_for(error.status);
}

const char* reason_name(CutReason reason) noexcept {
  switch (reason) {
    case CutReason::kWhole:
      return "whole";
    case CutReason::kComponent:
      return "component";
    case CutReason::kBoundaryStrength:
      return "boundary-strength";
    case CutReason::kHyperbolic:
      return "hyperbolic";
    case CutReason::kErrorTarget:
      return "error-target";
  }
  return "unknown";
}

}  // namespace sqmap::apps

namespace {

using sqmap::apps::Command;

/// The files that a command line names.
std::string positionals(const CLI::App& app) {
  std::string names;
  for (const CLI::Option* option : app.get_options())
    for (const std::string& name : option->get_positional() ? option->results() : CLI::results_t{})
      names += (names.empty() ? "" : ", ") + name;
  return names;
}

/// A command with the option --untrusted.
template <auto kDeclare>
std::function<sqmap::apps::Exit(sqmap::apps::Console&)> guarded(CLI::App& app) {
  const auto is_untrusted = std::make_shared<bool>(false);
  const auto command = kDeclare(app);
  app.add_flag("--untrusted", *is_untrusted,
               "For files of strangers: work in a child process of bounded memory and time");
  return [&app, is_untrusted, command](sqmap::apps::Console& console) {
    return *is_untrusted ? sqmap::apps::run_untrusted(console, positionals(app), command) : command(console);
  };
}

constexpr std::array<Command, 5> kCommands{{
    {"show", "Say what a bundle holds", guarded<sqmap::apps::declare_show>},
    {"validate", "Check a bundle against the rules of its format", guarded<sqmap::apps::declare_validate>},
    {"query", "Distances and normals for points", guarded<sqmap::apps::declare_query>},
    {"export", "Write a 3-D scene, a segmentation or pictures of the maps",
     guarded<sqmap::apps::declare_export>},
    {"diff", "Compare two bundles", guarded<sqmap::apps::declare_diff>},
}};

constexpr const char* kExamples =
    "  sqinfo show hand.h5\n"
    "  sqinfo validate hand.h5 --level full\n"
    "  echo 0.1,0.2,0.3 | sqinfo query hand.h5 --points -\n"
    "  sqinfo export hand.h5 --glb hand.glb --source hand.off\n"
    "  sqinfo diff old.h5 new.h5 --tolerance 1e-6\n"
    "  sqinfo validate stranger.h5 --untrusted\n";

}  // namespace

int main(int argc, char** argv) {
  return sqmap::apps::run({"sqinfo", "Inspects superquadric map bundles.", kExamples, kCommands}, argc, argv);
}

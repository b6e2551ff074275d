// SPDX-License-Identifier: GPL-3.0-or-later
#include <cstdint>
#include <filesystem>
#include <memory>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "../common/files.hpp"
#include "commands.hpp"
#include "page_files.hpp"

namespace sqmap::apps {
namespace {

constexpr std::uint64_t kMostBytes = 64U << 20;  ///< sixty times those of a whole run

struct DrawArguments {
  std::filesystem::path results, out;
};

Exit draw(Console& console, const DrawArguments& arguments) {
  const auto bytes = read_file(arguments.results, kMostBytes);
  if (!bytes) return report(console, arguments.results, bytes.error());
  Result<bench::Results> results = bench::results_from_json(as_text(bytes.value()));
  if (!results) return report(console, arguments.results, results.error());
  for (const char* name : bench::kDrawings) {
    const std::filesystem::path file = arguments.results.parent_path() / (std::string(name) + ".svg");
    const auto svg = read_file(file, kMostBytes);
    if (svg)
      results.value().drawings.push_back({name, {}, std::string(as_text(svg.value()))});
    else
      console.note(fmt::format("{}: left out, no such file beside the results", file.string()));
  }
  const Exit written = write_page(console, arguments.out, results.value());
  if (written == Exit::kOk)
    console.out(fmt::format("the page is {}\n", (arguments.out / "index.html").string()));
  return written;
}

}  // namespace

std::function<Exit(Console&)> declare_draw(CLI::App& app) {
  const auto args = std::make_shared<DrawArguments>();
  app.description(
      "Writes the page, the pictures and results.csv of a run once more, from its results.json; measures\n"
      "nothing. Pictures of objects (fig04.svg, fig10.svg) hold no numbers: they are taken from beside the\n"
      "results, or left out.\n"
      "\n"
      "Examples:\n"
      "  sqbench draw results/bench.json -o build/page\n");
  app.add_option("RESULTS", args->results, "A results.json of sqbench run")->required()->type_name("FILE");
  app.add_option("-o,--out", args->out, "Folder for the page")->required()->type_name("DIR");
  return [args](Console& console) { return draw(console, *args); };
}

}  // namespace sqmap::apps

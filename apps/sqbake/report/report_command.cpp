// SPDX-License-Identifier: GPL-3.0-or-later
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "../../common/confinement.hpp"
#include "../../common/files.hpp"
#include "../commands.hpp"
#include "../overwrite.hpp"
#include "asset_records.hpp"
#include "report_page.hpp"

namespace sqmap::apps {
namespace {

struct ReportArguments {
  std::vector<std::filesystem::path> records;
  std::filesystem::path output;
  bool force = false;
  ReportOptions options{"", ReportOptions{}.picture_count};
};

Exit run_report(Console& console, const ReportArguments& arguments) {
  if (arguments.output != "-") {
    Outcome ok = check_apart("-o", arguments.output, "an input", arguments.records);
    if (ok) ok = check_page("-o", arguments.output, arguments.force);
    if (!ok) return refuse(console, "-o " + arguments.output.string(), ok.error());
  }
  std::vector<AssetRecord> all;
  for (const std::filesystem::path& file : arguments.records) {
    Result<AssetRecords> records = read_asset_records(file);
    if (!records) return refuse(console, file.string(), records.error());
    if (records.value().is_cut_off)
      console.warning(fmt::format("{}: the last record is cut off and left out", file.string()));
    for (AssetRecord& record : records.value().records) all.push_back(std::move(record));
  }
  ReportOptions options = arguments.options;
  if (options.title.empty()) options.title = "sqbake: " + arguments.records.front().string();
  const std::string page = report_page(all, options);
  if (arguments.output == "-") {
    console.out(page);
  } else if (const Outcome written = write_file(arguments.output, page); !written) {
    return refuse(console, arguments.output.string(), written.error());
  }
  return Exit::kOk;
}

}  // namespace

std::function<Exit(Console&)> declare_report(CLI::App& app) {
  const auto args = std::make_shared<ReportArguments>();
  app.description(
      "Makes one HTML page of the records of a bake: outcomes, failures, largest errors, slowest assets, "
      "and\n"
      "pictures of the parts, drawn from the bundles. The page needs no other file.\n"
      "\n"
      "Examples:\n"
      "  sqbake report records.ndjson -o report.html\n"
      "  sqbake bake models/ --out-dir bundles/ --format ndjson | sqbake report - -o report.html\n");
  app.add_option("RECORDS", args->records, "What `sqbake bake --format ndjson` wrote; -: standard input")
      ->required();
  app.add_option("-o,--output", args->output, "Page to write; -: standard output")
      ->required()
      ->type_name("FILE.html");
  app.add_option("--title", args->options.title, "Heading (default: the first file of records)")
      ->type_name("TEXT");
  app.add_option("--pictures", args->options.picture_count,
                 fmt::format("Draw at most so many assets, the worst and slowest first\n(default {})",
                             ReportOptions{}.picture_count))
      ->type_name("COUNT");
  app.add_flag("--force", args->force, "Overwrite a file that is no page of sqbake, too");
  return [args](Console& console) {
    return run_confined(console, {{.heap_bytes = physical_memory_bytes(), .may_start_threads = true},
                                  args->records.front().string(),
                                  "report this with the records and the bundles that they name",
                                  [&](Console& child) { return run_report(child, *args); }});
  };
}

}  // namespace sqmap::apps

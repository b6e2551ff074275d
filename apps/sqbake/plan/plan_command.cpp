// SPDX-License-Identifier: GPL-3.0-or-later
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "../../common/choices.hpp"
#include "../../common/json_text.hpp"
#include "../../common/printable.hpp"
#include "../commands.hpp"
#include "../job_list.hpp"
#include "../settings.hpp"
#include "shard_jobs.hpp"

namespace sqmap::apps {
namespace {

struct PlanArguments {
  JobRequest request;
  std::uint32_t shards = 1;
  std::optional<std::string> shard;
  std::filesystem::path costs;  ///< records; may be empty
  std::string format = "text";
};

Exit run_plan(Console& console, const PlanArguments& arguments) {
  std::optional<Shard> only;
  if (arguments.shard) {
    const Result<Shard> shard = parse_shard(*arguments.shard);
    if (!shard) return refuse(console, shard.error());
    only = shard.value();
  }
  if (const auto ok = options_from(arguments.request.config.command_line); !ok)
    return refuse(console, ok.error());
  const Result<JobList> list = list_jobs(arguments.request);
  if (!list) return refuse(console, list.error());
  const std::uint32_t count = only ? only->count : arguments.shards;
  const Result<std::vector<std::uint64_t>> costs = costs_of(console, list.value(), arguments.costs);
  if (!costs) return refuse(console, costs.error());
  const std::vector<std::uint32_t> shard_of = shards_of(list.value(), costs.value(), count);

  struct Sum {
    std::size_t assets = 0;
    std::uint64_t cost = 0;
  };
  std::vector<Sum> sums(count);
  for (std::size_t k = 0; k < shard_of.size(); ++k) {
    const Job& job = list.value().jobs[k];
    const std::uint64_t cost = costs.value()[k];
    ++sums[shard_of[k]].assets;
    sums[shard_of[k]].cost += cost;
    if (only && shard_of[k] != only->index) continue;
    if (arguments.format == "ndjson") {
      console.out(json_line({{"schema", "sqmap.plan/1"},
                             {"type", "plan"},
                             {"input", json_name(job.input.string())},
                             {"output", json_name(job.output.string())},
                             {"input_bytes", job.input_bytes},
                             {"cost", cost},
                             {"shard", shard_of[k] + 1},
                             {"shards", count}}));
    } else if (only) {
      console.out(printable(fmt::format("{} -> {}", job.input.string(), job.output.string())) + "\n");
    }
  }
  if (arguments.format == "text" && !only) {
    console.out(fmt::format("{:>8} {:>8} {:>14}\n", "shard", "assets", "cost"));
    for (std::uint32_t shard = 0; shard < count; ++shard)
      console.out(fmt::format("{:>8} {:>8} {:>14}\n", fmt::format("{}/{}", shard + 1, count),
                              sums[shard].assets, sums[shard].cost));
  }
  return Exit::kOk;
}

}  // namespace

std::function<Exit(Console&)> declare_plan(CLI::App& app) {
  const auto args = std::make_shared<PlanArguments>();
  JobRequest& request = args->request;
  app.description(
      "Deals meshes out to machines: prints what `sqbake bake` would bake, what each is expected to cost, "
      "and in\n"
      "which shard. Every machine that sees the same meshes gets the same plan; `sqbake bake --shard I/N` "
      "bakes one\n"
      "shard of it, `sqbake merge` joins the records.\n"
      "\n"
      "Examples:\n"
      "  sqbake plan models/ --recursive --out-dir bundles/ --shards 8\n"
      "  sqbake plan models/ --recursive --out-dir bundles/ --shards 8 --format ndjson > plan.ndjson\n"
      "  sqbake plan models/ --recursive --out-dir bundles/ --shard 3/8\n"
      "  sqbake plan models/ --recursive --out-dir bundles/ --shards 8 --costs last-month.ndjson\n");
  app.add_option("INPUT", request.inputs, "Mesh files, folders, patterns and @lists of them");
  app.add_option("--manifest", request.manifest, "As of `sqbake bake`")->type_name("FILE.toml");
  app.add_option("--out-dir", request.out_dir, "As of `sqbake bake`")->type_name("DIR")->required();
  app.add_flag("--recursive", request.recursive, "Look below the folders named, too");
  app.add_flag("--keep-extension", request.keep_extension, "Call the bundles NAME.off.h5, not NAME.h5");
  // They decide nothing here, but who plans a bake finds out what is wrong with them before it begins.
  add_all_setting_options(app, request.config.command_line);
  app.add_option("--config", request.config.project, "As of `sqbake bake`")->type_name("FILE.toml");
  app.add_flag("!--no-config", request.config.use_files, "As of `sqbake bake`");
  CLI::Option* shards = app.add_option("--shards", args->shards, "Number of shards (default 1)")
                            ->check(CLI::Range(1, 1'000'000).description(""))
                            ->type_name("N");
  app.add_option("--costs", args->costs,
                 "Records of an earlier bake (--format ndjson): what a mesh took then counts, not its size")
      ->type_name("FILE.ndjson");
  app.add_option("--shard", args->shard, "Only one of N; auto: as the job array of Slurm or Kubernetes says")
      ->excludes(shards)
      ->type_name("I/N");
  add_words(app, "--format", args->format, {"text", "ndjson"},
            "text or ndjson, one line a mesh (default text)");
  return [args](Console& console) { return run_plan(console, *args); };
}

}  // namespace sqmap::apps

// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "sqmap/io/bundle.hpp"
#include "sqmap/runtime/object.hpp"

#include "../common/choices.hpp"
#include "../common/files.hpp"
#include "commands.hpp"
#include "points_csv.hpp"

namespace sqmap::apps {
namespace {

using runtime::Layer;

constexpr std::uint64_t kMaxPointBytes = std::uint64_t{4} << 30;

struct QueryArguments {
  std::filesystem::path bundle, points;
  runtime::QueryOptions options;
  bool with_certainty = false;
};

const char* certainty_name(runtime::Certainty certainty) {
  switch (certainty) {
    case runtime::Certainty::kOutside:
      return "outside";
    case runtime::Certainty::kInside:
      return "inside";
    case runtime::Certainty::kUnsure:
      break;
  }
  return "unsure";
}

std::string csv_line(const Vec3f& p, const runtime::Answer& answer) {
  std::string distance, normal = ",,", part;
  if (answer.signed_distance_m == answer.signed_distance_m) {  // not NaN
    distance = fmt::format("{}", answer.signed_distance_m);
  } else if (answer.part == runtime::kNowhere) {
    distance = "outside";
  }
  if (norm(answer.normal) > 0)
    normal = fmt::format("{},{},{}", answer.normal.x, answer.normal.y, answer.normal.z);
  if (answer.part != runtime::kNowhere) part = fmt::format("{}", answer.part);
  return fmt::format("{},{},{},{},{},{},{},{}", p.x, p.y, p.z, answer.inside ? 1 : 0, distance, normal, part,
                     static_cast<int>(answer.layer));
}

Exit run_query(Console& console, const QueryArguments& arguments) {
  const Result<Asset> asset = io::read(arguments.bundle);
  if (!asset) return report(console, arguments.bundle, asset.error());
  const Result<runtime::Object> object = runtime::Object::build(asset.value());
  if (!object) return report(console, arguments.bundle, object.error());

  if (arguments.with_certainty && std::isnan(object.value().certainty_tolerance_m()))
    return report(console, arguments.bundle,
                  {Status::kInvalidAsset, "has no bounds of the surface, which --certainty asks for",
                   "bake with --conservative on"});

  const bool is_stdin = arguments.points == "-";
  const std::filesystem::path name = is_stdin ? "standard input" : arguments.points;
  const Result<std::vector<std::uint8_t>> bytes =
      is_stdin ? read_stdin(kMaxPointBytes) : read_file(arguments.points, kMaxPointBytes);
  if (!bytes) return report(console, name, bytes.error());
  const Result<std::vector<Vec3f>> points = parse_points(as_text(bytes.value()));
  if (!points) return report(console, name, points.error());

  constexpr std::size_t kFlushBytes = 1 << 16;
  std::string text = "x,y,z,inside,signed_distance,nx,ny,nz,part,layer";
  text += arguments.with_certainty ? ",certainty\n" : "\n";
  for (const Vec3f& p : points.value()) {
    text += csv_line(p, object.value().query(p, arguments.options));
    if (arguments.with_certainty) text += fmt::format(",{}", certainty_name(object.value().certainty(p)));
    text += '\n';
    if (text.size() >= kFlushBytes) {
      console.out(text);
      text.clear();
    }
  }
  console.out(text);
  return Exit::kOk;
}

}  // namespace

std::function<Exit(Console&)> declare_query(CLI::App& app) {
  const auto args = std::make_shared<QueryArguments>();
  app.description(
      "Queries a bundle at points and writes CSV: x,y,z,inside,signed_distance,nx,ny,nz,part,layer. Object "
      "frame,\n"
      "metres; the distance is negative inside, the normal points outwards. Outside every superquadric the "
      "distance\n"
      "is the word `outside` and the part is empty; fields that the layer cannot know are empty. Points are "
      "read as\n"
      "x,y,z lines in single precision, with or without a header line.\n"
      "\n"
      "Examples:\n"
      "  sqinfo query hand.h5 --points points.csv > answers.csv\n"
      "  echo 0.1,0.2,0.3 | sqinfo query hand.h5 --points - --layer 3\n");
  app.add_option("BUNDLE", args->bundle, "Bundle file")->required();
  app.add_option("--points", args->points, "CSV file of points, or - for standard input")
      ->required()
      ->type_name("FILE");
  add_choice<Layer>(
      app, "--layer", args->options.layer,
      {{"auto", Layer::kAuto}, {"1", Layer::kOne}, {"2", Layer::kTwo}, {"3", Layer::kThree}},
      "1: superquadrics only; 2: distance map; 3: closest point; auto: 2 or 3 by resolution (default auto)");
  app.add_option("--level", args->options.level, "Level of the maps, 0 the finest (default 0)")
      ->check(CLI::Range(0, 31).description(""))
      ->type_name("LEVEL");
  app.add_flag("--certainty", args->with_certainty,
               "Also a column `certainty`: outside and inside are proven, unsure is not (the bundle must be\n"
               "baked with --conservative on)");
  return [args](Console& console) { return run_query(console, *args); };
}

}  // namespace sqmap::apps

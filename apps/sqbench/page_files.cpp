// SPDX-License-Identifier: GPL-3.0-or-later
#include "page_files.hpp"

#include <string>
#include <utility>
#include <vector>

#include "../common/files.hpp"

namespace sqmap::apps {

Exit report(Console& console, const std::filesystem::path& file, const Error& error) {
  console.error(message_for(file.string(), error));
  return exit_for(error.status);
}

Exit write_page(Console& console, const std::filesystem::path& folder, const bench::Results& results) {
  std::error_code problem;
  std::filesystem::create_directories(folder, problem);  // a folder that is missing shows in the first file
  const std::vector<bench::Picture> pictures = bench::pictures(results);
  std::vector<std::pair<std::string, std::string>> files{
      {"results.csv", bench::results_csv(results)}, {"index.html", bench::results_page(results, pictures)}};
  for (const bench::Picture& picture : pictures) files.emplace_back(picture.name + ".svg", picture.svg);
  for (const auto& [name, text] : files)
    if (const Outcome written = write_file(folder / name, text); !written)
      return report(console, folder / name, written.error());
  return Exit::kOk;
}

}  // namespace sqmap::apps

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

#include "sqmap/asset/result.hpp"

namespace CLI {
class App;
}

namespace sqmap::apps {

/// Documents made from the command line as it is declared, so that they cannot disagree with it: "man"
/// (troff, a page of section 1), "bash", "zsh" or "fish" (a completion script). Errors: kBadOption.
Result<std::string> shell_document(const CLI::App& program, std::string_view kind);

}  // namespace sqmap::apps

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

namespace sqmap::apps {

/// A file name may hold line feeds and escape sequences: \x0a for those, so that they neither forge lines nor
/// drive the terminal. Console does this to messages; what goes to standard output as text needs it, too.
std::string printable(std::string_view text);

}  // namespace sqmap::apps

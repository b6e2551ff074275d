// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>

namespace sqmap::apps {

/// `text` for an element or a quoted attribute: characters that markup reserves become entities.
std::string html_text(std::string_view text);

/// RFC 4648, with padding.
std::string base64(std::span<const std::uint8_t> bytes);

}  // namespace sqmap::apps

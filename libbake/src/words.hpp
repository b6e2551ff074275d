// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

namespace sqmap::bake {

/// Words of a text, parted by white space. A word that begins with # begins a comment, which is left out.
class Words {
 public:
  explicit Words(std::string_view text) : text_(text) {}

  /// The next word, across lines; empty at the end of the text.
  std::string_view next();
  /// To the end of the current line.
  void skip_line();
  /// The rest of the current line, and on to the next.
  std::string_view next_line();
  std::size_t line() const { return line_; }  ///< of the word last returned, counted from 1
  std::size_t bytes_left() const { return text_.size() - at_; }
  std::string_view rest() const { return text_.substr(at_); }

 private:
  void step();

  std::string_view text_;
  std::size_t at_ = 0;
  std::size_t line_ = 1;
};

/// A word of a file in quotation marks, fit to be printed: cut when long, other than ASCII replaced.
std::string quoted(std::string_view word);

/// False when the word is anything but one number. Numbers beyond the range of double become infinite or
/// zero.
bool parse_integer(std::string_view word, std::int64_t& value);
bool parse_number(std::string_view word, double& value);

}  // namespace sqmap::bake

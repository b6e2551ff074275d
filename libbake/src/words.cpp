// SPDX-License-Identifier: GPL-3.0-or-later
#include "words.hpp"

#include <charconv>
#include <limits>
#include <system_error>

namespace sqmap::bake {
namespace {

bool is_line_end(char c) { return c == '\n' || c == '\r'; }
bool is_space(char c) { return c == ' ' || c == '\t' || c == '\v' || c == '\f' || is_line_end(c); }

std::string_view without_plus(std::string_view word) {
  return word.size() > 1 && word[0] == '+' && word[1] != '-' ? word.substr(1) : word;
}

}  // namespace

std::string_view Words::next() {
  while (at_ < text_.size() && (is_space(text_[at_]) || text_[at_] == '#')) {
    if (text_[at_] == '#')
      skip_line();
    else
      step();
  }
  const std::size_t begin = at_;
  while (at_ < text_.size() && !is_space(text_[at_])) ++at_;
  return text_.substr(begin, at_ - begin);
}

void Words::skip_line() {
  while (at_ < text_.size() && !is_line_end(text_[at_])) ++at_;
}

std::string_view Words::next_line() {
  const std::size_t begin = at_;
  skip_line();
  const std::string_view line = text_.substr(begin, at_ - begin);
  const bool is_crlf = at_ + 1 < text_.size() && text_[at_] == '\r' && text_[at_ + 1] == '\n';
  if (is_crlf) step();
  if (at_ < text_.size()) step();
  return line;
}

void Words::step() {
  const char c = text_[at_++];
  const bool is_crlf = c == '\r' && at_ < text_.size() && text_[at_] == '\n';
  if (is_line_end(c) && !is_crlf) ++line_;
}

std::string quoted(std::string_view word) {
  constexpr std::size_t kLongest = 24;
  std::string text = "\"";
  for (const char c : word.substr(0, kLongest)) text += c >= ' ' && c <= '~' ? c : '?';
  return text + (word.size() > kLongest ? "...\"" : "\"");
}

bool parse_integer(std::string_view word, std::int64_t& value) {
  word = without_plus(word);
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  return error == std::errc() && end == word.data() + word.size();
}

bool parse_number(std::string_view word, double& value) {
  word = without_plus(word);
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (end != word.data() + word.size()) return false;
  if (error == std::errc::result_out_of_range) {  // leaves the value alone, for tiny numbers as for huge ones
    const bool is_tiny = word.find("e-") != word.npos || word.find("E-") != word.npos;
    value = is_tiny ? 0 : std::numeric_limits<double>::infinity();
    return true;
  }
  return error == std::errc();
}

}  // namespace sqmap::bake

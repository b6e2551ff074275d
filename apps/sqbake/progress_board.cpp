// SPDX-License-Identifier: GPL-3.0-or-later
#include "progress_board.hpp"

#include <algorithm>
#include <cstdlib>
#include <utility>

#include <fmt/format.h>

namespace sqmap::apps {
namespace {

// Ten a second read as motion; more only costs the terminal.
constexpr std::chrono::milliseconds kRedrawInterval{100};

}  // namespace

ProgressBoard::ProgressBoard(Console& console, When when, std::vector<Item> items)
    : console_(console),
      style_(when == When::kNever ? Style::kNone
             : console.stderr_is_terminal() && (when == When::kAlways || std::getenv("CI") == nullptr)
                 ? Style::kLine
             : when == When::kAlways ? Style::kPlain
                                     : Style::kNone),
      items_(std::move(items)),
      states_(items_.size()),
      start_(Clock::now()),
      last_draw_(start_ - kRedrawInterval) {
  for (const Item& item : items_) total_weight_ += item.weight;
}

void ProgressBoard::at(std::size_t index, std::string_view stage, double fraction) {
  if (style_ == Style::kNone) return;
  const std::scoped_lock lock(mutex_);
  State& state = states_[index];
  const bool is_new_stage = !state.is_running || state.stage != stage;
  state = {std::string(stage), std::clamp(fraction, 0.0, 1.0), true};
  if (style_ == Style::kPlain) {
    if (is_new_stage) console_.note(fmt::format("{}{}: {}", count(), items_[index].name, stage));
    return;
  }
  if (is_new_stage || Clock::now() - last_draw_ >= kRedrawInterval) draw(index);
}

void ProgressBoard::finished(std::size_t index) {
  const std::scoped_lock lock(mutex_);
  states_[index].is_running = false;
  ++finished_count_;
  finished_weight_ += items_[index].weight;
  if (style_ != Style::kLine) return;
  console_.status({});
  for (std::size_t other = 0; other < states_.size(); ++other)
    if (states_[other].is_running) return draw(other);
}

void ProgressBoard::draw(std::size_t index) {
  last_draw_ = Clock::now();
  std::string line = fmt::format("{}{}  {} {:.0f} %", count(), items_[index].name, states_[index].stage,
                                 100 * states_[index].fraction);
  const auto running = std::ranges::count_if(states_, &State::is_running);
  if (running > 1) line += fmt::format(" and {} more", running - 1);
  console_.status(line + rate_and_time_left());
}

void ProgressBoard::skip(std::size_t index) {
  const std::scoped_lock lock(mutex_);
  ++skipped_count_;
  total_weight_ -= items_[index].weight;
}

std::string ProgressBoard::count() const {
  if (items_.size() < 2) return "";
  return fmt::format("[{}/{}] ", finished_count_ + skipped_count_, items_.size());
}

std::string ProgressBoard::rate_and_time_left() const {
  if (finished_count_ == 0 || finished_weight_ == 0 || items_.size() < 2) return "";
  const double elapsed_s = std::chrono::duration<double>(Clock::now() - start_).count();
  const double rate_per_s = static_cast<double>(finished_count_) / elapsed_s;
  const auto left_s = static_cast<long>(elapsed_s * static_cast<double>(total_weight_ - finished_weight_) /
                                        static_cast<double>(finished_weight_));
  const std::string rate =
      rate_per_s >= 1 ? fmt::format("{:.1f}/s", rate_per_s) : fmt::format("{:.1f}/min", 60 * rate_per_s);
  return fmt::format("  {}  {}:{:02}:{:02} left", rate, left_s / 3600, left_s / 60 % 60, left_s % 60);
}

}  // namespace sqmap::apps

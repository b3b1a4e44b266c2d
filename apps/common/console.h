// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <cstdio>
#include <functional>
#include <map>
#include <mutex>
#include <string>
#include <string_view>

namespace sarnerf::app {

/// How fast the stages of a program advance. Work that was done before a stage was first reported, in an earlier run say, does not
/// count. A stage that another one interrupts keeps its beginning, so that its rate includes the other's time; one whose count falls
/// begins anew.
class StageRates {
 public:
  using Clock = std::chrono::steady_clock;

  /// Units a second so far; 0 at the beginning.
  double rate(std::string_view stage, std::uint64_t done, Clock::time_point now);
  void end(std::string_view stage);

 private:
  struct Beginning {
    Clock::time_point time;
    std::uint64_t done, last_done;
  };
  std::map<std::string, Beginning, std::less<>> stages_;
};

/// Messages of a program to its user, on stderr; results go to stdout. Safe to use from several threads.
class Console {
 public:
  /// Writes to `stream`, or else to a duplicate of stderr of its own. The duplicate keeps working while file
  /// descriptor 2 is redirected (image decoders print there, and are silenced).
  explicit Console(std::string program, std::FILE* stream = nullptr);
  ~Console();
  Console(const Console&) = delete;
  Console& operator=(const Console&) = delete;

  /// −1 quiet: warnings and errors only; 0 normal; 1 and more: details too.
  void set_verbosity(int verbosity) { verbosity_ = verbosity; }

  void detail(std::string_view line);
  void note(std::string_view line);
  void warning(std::string_view line);
  void error(std::string_view line);
  void asked_for(std::string_view lines);  ///< output that an option requests: printed even when quiet, unescaped

  /// Shows a progress bar with rate and time left on a terminal; elsewhere a line every ten seconds. Another stage,
  /// or done == total, ends the bar. `detail` follows the figures.
  void progress(std::string_view stage, std::uint64_t done, std::uint64_t total,
                std::string_view detail = {});

 private:
  using Clock = StageRates::Clock;

  void print(std::string_view label, std::string_view line);
  void clear_bar();
  std::string progress_text(std::uint64_t done, std::uint64_t total, double rate) const;

  std::mutex mutex_;
  std::string program_;
  std::FILE* own_;  ///< null: stream_ is not owned
  std::FILE* stream_;
  bool terminal_;
  int verbosity_ = 0;
  bool bar_drawn_ = false;
  std::string stage_;
  StageRates rates_;
  Clock::time_point last_drawn_;
};

/// The text with control characters written as \x0a. File names may contain any of them, which would split a message
/// or disturb the terminal.
std::string visible(std::string_view text);

/// Writes to stdout and flushes it. Throws Error if stdout is full or closed.
void print_result(std::string_view text);

}  // namespace sarnerf::app

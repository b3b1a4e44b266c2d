// SPDX-License-Identifier: Apache-2.0
#include "console.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "sarnerf/core/error.h"

namespace sarnerf::app {
namespace {

using namespace std::chrono_literals;
constexpr auto kBarInterval = 100ms;
constexpr auto kLineInterval = 10s;
constexpr int kBarWidth = 28;

/// Null if stderr cannot be duplicated.
std::FILE* copy_of_stderr() {
  const int fd = ::fcntl(STDERR_FILENO, F_DUPFD_CLOEXEC, STDERR_FILENO + 1);
  if (fd < 0) return nullptr;
  std::FILE* const stream = ::fdopen(fd, "w");
  if (stream == nullptr) ::close(fd);
  return stream;
}

std::string duration_text(double seconds) {
  const auto s = static_cast<unsigned long long>(seconds + 0.5);
  char text[40];
  if (s >= 3600) {
    std::snprintf(text, sizeof text, "%llu:%02llu:%02llu", s / 3600, s / 60 % 60, s % 60);
  } else {
    std::snprintf(text, sizeof text, "%llu:%02llu", s / 60, s % 60);
  }
  return text;
}

}  // namespace

std::string visible(std::string_view text) {
  std::string line;
  for (const char c : text) {
    if (static_cast<unsigned char>(c) >= 0x20 && c != 0x7f) {
      line += c;
      continue;
    }
    char code[8];
    std::snprintf(code, sizeof code, "\\x%02x", static_cast<unsigned>(static_cast<unsigned char>(c)));
    line += code;
  }
  return line;
}

double StageRates::rate(std::string_view stage, std::uint64_t done, Clock::time_point now) {
  const auto place = stages_.find(stage);
  if (place == stages_.end() || done < place->second.last_done) {
    stages_.insert_or_assign(std::string(stage), Beginning{now, done, done});
    return 0.0;
  }
  Beginning& beginning = place->second;
  beginning.last_done = done;
  const double elapsed_s = std::chrono::duration<double>(now - beginning.time).count();
  return elapsed_s > 0.0 ? double(done - beginning.done) / elapsed_s : 0.0;
}

void StageRates::end(std::string_view stage) { stages_.erase(std::string(stage)); }

Console::Console(std::string program, std::FILE* stream)
    : program_(std::move(program)),
      own_(stream == nullptr ? copy_of_stderr() : nullptr),
      stream_(own_ != nullptr ? own_ : stream != nullptr ? stream : stderr),
      terminal_(::isatty(::fileno(stream_)) == 1) {}

Console::~Console() {
  clear_bar();
  if (own_ != nullptr) std::fclose(own_);
}

void Console::detail(std::string_view line) {
  if (verbosity_ >= 1) print("", visible(line));
}
void Console::note(std::string_view line) {
  if (verbosity_ >= 0) print("", visible(line));
}
void Console::warning(std::string_view line) { print("warning: ", visible(line)); }
void Console::error(std::string_view line) { print("error: ", visible(line)); }

void Console::asked_for(std::string_view lines) { print("", lines); }

void Console::print(std::string_view label, std::string_view line) {
  const std::scoped_lock lock(mutex_);
  clear_bar();
  std::fprintf(stream_, "%s: %.*s%.*s\n", program_.c_str(), static_cast<int>(label.size()),
               label.data(), static_cast<int>(line.size()), line.data());
  std::fflush(stream_);
}

void Console::clear_bar() {
  if (!bar_drawn_) return;
  std::fputs("\r\033[K", stream_);
  bar_drawn_ = false;
}

void Console::progress(std::string_view stage, std::uint64_t done, std::uint64_t total,
                       std::string_view detail) {
  if (verbosity_ < 0) return;
  const std::scoped_lock lock(mutex_);
  const Clock::time_point now = Clock::now();
  const double rate = rates_.rate(stage, done, now);
  if (stage != stage_) {
    stage_ = stage;
    last_drawn_ = now;
  }
  const bool finished = total > 0 && done >= total;
  if (finished) {
    clear_bar();
    std::fflush(stream_);
    rates_.end(stage_);
    stage_.clear();
    return;
  }
  if (now - last_drawn_ < (terminal_ ? Clock::duration(kBarInterval) : Clock::duration(kLineInterval))) {
    return;
  }
  last_drawn_ = now;
  std::string text = progress_text(done, total, rate);
  if (!detail.empty()) text.append("  ").append(detail);
  if (terminal_) {
    std::fprintf(stream_, "\r\033[K%s", text.c_str());
    bar_drawn_ = true;
  } else {
    std::fprintf(stream_, "%s: %s\n", program_.c_str(), text.c_str());
  }
  std::fflush(stream_);
}

std::string Console::progress_text(std::uint64_t done, std::uint64_t total, double rate) const {
  char figures[160];
  if (total == 0) {
    std::snprintf(figures, sizeof figures, " %llu  %.3g/s", static_cast<unsigned long long>(done), rate);
    return stage_ + figures;
  }
  const double share = double(done) / double(total);
  const std::string left = rate > 0.0 ? duration_text(double(total - done) / rate) : "?";
  std::snprintf(figures, sizeof figures, "%3.0f%%  %llu/%llu  %.3g/s  %s left", 100.0 * share,
                static_cast<unsigned long long>(done), static_cast<unsigned long long>(total), rate,
                left.c_str());
  if (!terminal_) return stage_ + " " + figures;
  const int filled = static_cast<int>(share * kBarWidth);
  return stage_ + " [" + std::string(static_cast<std::size_t>(filled), '#') +
         std::string(static_cast<std::size_t>(kBarWidth - filled), '.') + "] " + figures;
}

void print_result(std::string_view text) {
  const bool written = std::fwrite(text.data(), 1, text.size(), stdout) == text.size();
  if (!written || std::fflush(stdout) != 0) {
    throw Error(std::string("the result cannot be written to stdout: ") + std::strerror(errno));
  }
}

}  // namespace sarnerf::app

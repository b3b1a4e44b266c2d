// SPDX-License-Identifier: Apache-2.0
#include "process.h"

#include <algorithm>
#include <chrono>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <optional>
#include <sstream>

#include <sys/resource.h>
#include <unistd.h>

#include "values.h"

namespace sarnerf::app {

namespace {

double clock_s(clockid_t clock) {
  timespec now = {};
  clock_gettime(clock, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

double seconds_since_boot() { return clock_s(CLOCK_BOOTTIME); }

/// Seconds from boot to the start of this process; the present time if the system does not report it.
double start_s() {
  std::ifstream stat("/proc/self/stat");
  std::string text;
  std::getline(stat, text);
  // The program's name, the second field, stands in parentheses and may hold anything.
  const auto end = text.rfind(')');
  if (end == std::string::npos) return seconds_since_boot();
  std::istringstream fields(text.substr(end + 1));
  std::string skipped;
  for (int field = 3; field < 22; ++field) fields >> skipped;
  double ticks = 0.0;
  if (!(fields >> ticks)) return seconds_since_boot();
  const double s = ticks / static_cast<double>(sysconf(_SC_CLK_TCK));
  const double age_s = seconds_since_boot() - s;
  // A shell may do other work in this process before it executes the program, and the clocks of containers may
  // disagree. So an age far above the CPU time spent so far (loading libraries) is rejected. On a busy machine, the
  // age may be a few times that CPU time.
  const double computed_s = clock_s(CLOCK_PROCESS_CPUTIME_ID);
  constexpr double kBusy = 4.0, kDisk_s = 0.2;
  return age_s >= 0.0 && age_s < kBusy * computed_s + kDisk_s ? s
                                                              : seconds_since_boot() - computed_s;
}

}  // namespace

double seconds_since_start() {
  static const double start = start_s();
  return seconds_since_boot() - start;
}

std::uint64_t peak_memory_bytes() {
  rusage usage = {};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<std::uint64_t>(usage.ru_maxrss) * 1024;
}

std::string processor_name() {
  std::ifstream info("/proc/cpuinfo");
  for (std::string line; std::getline(info, line);) {
    if (line.rfind("model name", 0) == 0) return line.substr(line.find(':') + 2);
  }
  return "unknown";
}

namespace {

/// The number in a file of one word; nothing for "max".
std::optional<std::uint64_t> number_in(const std::filesystem::path& path) {
  std::ifstream file(path);
  std::uint64_t value = 0;
  if (file >> value) return value;
  return std::nullopt;
}

/// The number that follows a word in a file: "MemAvailable:   24056452 kB".
std::optional<std::uint64_t> number_behind(const std::filesystem::path& path, const std::string& name) {
  std::ifstream file(path);
  for (std::string word; file >> word;) {
    std::uint64_t value = 0;
    if (word == name && file >> value) return value;
  }
  return std::nullopt;
}

/// Bytes that control groups (version 2) leave: the least from this process's own group up to the root. The groups
/// count the page cache as used; it is subtracted here, because the system frees it when memory is needed.
std::optional<std::uint64_t> left_in_groups() {
  const std::filesystem::path root = "/sys/fs/cgroup";
  std::ifstream groups("/proc/self/cgroup");
  std::optional<std::uint64_t> least;
  for (std::string line; std::getline(groups, line);) {
    if (!line.starts_with("0::/")) continue;
    for (std::filesystem::path group = root / line.substr(4);; group = group.parent_path()) {
      const auto most = number_in(group / "memory.max"), used = number_in(group / "memory.current");
      if (most && used) {
        const std::uint64_t kept = *used - std::min(*used, number_behind(group / "memory.stat", "file").value_or(0));
        const std::uint64_t left = *most - std::min(*most, kept);
        least = std::min(least.value_or(left), left);
      }
      if (group == root || !group.has_relative_path()) break;
    }
  }
  return least;
}

}  // namespace

std::uint64_t available_memory_bytes() {
  constexpr std::uint64_t kKiB = 1024;
  const auto machine = number_behind("/proc/meminfo", "MemAvailable:");
  const auto groups = left_in_groups();
  if (!machine) return groups.value_or(0);
  return std::min(*machine * kKiB, groups.value_or(*machine * kKiB));
}

MemoryLimit memory_limit(const SharedOptions& options) {
  if (options.max_memory_bytes > 0) return {options.max_memory_bytes, true};
  return {options.any_memory ? 0 : available_memory_bytes(), false};
}

std::string MemoryLimit::text() const {
  return asked_for ? "--max-memory allows " + bytes_text(bytes)
                   : "this machine has " + bytes_text(bytes) + " left (--max-memory none to try)";
}

}  // namespace sarnerf::app

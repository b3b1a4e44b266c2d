// SPDX-License-Identifier: Apache-2.0
#include "memory_limit.h"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <optional>

#include "values.h"

namespace sarnerf::app {
namespace {

/// The number in a file of one word; nothing for "max".
std::optional<std::uint64_t> number_in(const std::filesystem::path& path) {
  std::ifstream file(path);
  std::uint64_t value = 0;
  if (file >> value) return value;
  return std::nullopt;
}

/// The number behind a name at the beginning of a line: "MemAvailable:   24056452 kB".
std::optional<std::uint64_t> number_behind(const std::filesystem::path& path, const std::string& name) {
  std::ifstream file(path);
  for (std::string word; file >> word;) {
    std::uint64_t value = 0;
    if (word == name && file >> value) return value;
  }
  return std::nullopt;
}

/// What control groups (version 2) leave: the tightest from this process's own up to the root. Pages of files count as
/// used there, although they are given up for others.
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

// SPDX-License-Identifier: Apache-2.0
#include "process.h"

#include <sys/resource.h>
#include <unistd.h>

#include <chrono>
#include <ctime>
#include <fstream>
#include <sstream>

namespace sarnerf::app {
namespace {

double clock_s(clockid_t clock) {
  timespec now = {};
  clock_gettime(clock, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

double seconds_since_boot() { return clock_s(CLOCK_BOOTTIME); }

/// Seconds from boot to the start of this process; now where the system does not tell.
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
  // A shell may do other work in this process before it becomes the program, and clocks of containers may disagree:
  // much more than the time spent computing so far, by loading libraries, is not ours. On a busy machine it may be a
  // few times that.
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

}  // namespace sarnerf::app

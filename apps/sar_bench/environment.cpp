// SPDX-License-Identifier: Apache-2.0
#include <fstream>
#include <string>

#include "sarnerf/core/parallel.h"
#include "sarnerf/mpa/integrate.h"
#include "studies.h"

namespace sarnerf::bench {
namespace {

std::string processor() {
  std::ifstream info("/proc/cpuinfo");
  for (std::string line; std::getline(info, line);) {
    if (line.rfind("model name", 0) == 0) return line.substr(line.find(':') + 2);
  }
  return "unknown";
}

}  // namespace

nlohmann::json environment() {
  return {{"processor", processor()},
          {"instruction_set", name(best_instruction_set())},
          {"threads", default_thread_count()},
          {"compiler", SARNERF_COMPILER},
          {"build_type", SARNERF_BUILD_TYPE},
          {"revision", SARNERF_REVISION}};
}

}  // namespace sarnerf::bench

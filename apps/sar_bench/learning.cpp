// SPDX-License-Identifier: Apache-2.0
#include "learning.h"

#include <unistd.h>

#include <string>
#include <vector>

#include "programs.h"
#include "sarnerf/core/error.h"

namespace sarnerf::bench {

void become_learning_bench(int argc, char** argv) {
  std::string program = program_beside("sar_nerf_bench").string();
  std::vector<char*> arguments{program.data()};
  arguments.insert(arguments.end(), argv + 2, argv + argc);
  arguments.push_back(nullptr);
  ::execv(program.c_str(), arguments.data());
  throw Error(program + " could not be started");
}

}  // namespace sarnerf::bench

// SPDX-License-Identifier: Apache-2.0
// replay FOLDER: gives every file of the folder to a fuzz target, without libFuzzer, so that seeds and past
// findings are tested in every build.
#include <cstdio>
#include <exception>
#include <filesystem>
#include <set>

#include "fuzz_target.h"
#include "sarnerf/core/files.h"

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fprintf(stderr, "Usage: %s FOLDER\n", argv[0]);
    return 2;
  }
  std::set<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(argv[1])) files.insert(entry.path());
  if (files.empty()) {
    std::fprintf(stderr, "%s: expected seeds, found none\n", argv[1]);
    return 1;
  }
  for (const std::filesystem::path& file : files) {
    // Said beforehand: what goes wrong may end the process.
    std::fprintf(stderr, "%s\n", file.c_str());
    const std::string bytes = sarnerf::read_whole_file(file);
    try {
      LLVMFuzzerTestOneInput(reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size());
    } catch (const std::exception& failure) {
      std::fprintf(stderr, "expected a result or a refusal, found another exception: %s\n", failure.what());
      return 1;
    }
  }
  return 0;
}

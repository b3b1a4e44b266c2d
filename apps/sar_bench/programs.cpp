// SPDX-License-Identifier: Apache-2.0
#include "programs.h"

#include <sys/wait.h>

#include <cstdlib>

#include "exit_code.h"
#include "sarnerf/core/error.h"

namespace sarnerf::bench {

std::filesystem::path program_beside(const std::string& name) {
  namespace fs = std::filesystem;
  const fs::path here = fs::read_symlink("/proc/self/exe").parent_path();
  for (const fs::path& place : {here / name, here / ".." / name / name})
    if (fs::is_regular_file(place)) return fs::weakly_canonical(place);
  throw Error(name + " is not beside sar_bench in " + here.string() + ": build it, or install both");
}

std::string quoted(const std::string& word) {
  std::string text = "'";
  for (const char c : word) text += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return text + "'";
}

int run_beside(const std::string& name, const std::vector<std::string>& arguments) {
  std::string line = quoted(program_beside(name).string());
  for (const std::string& argument : arguments) line += " " + quoted(argument);
  const int status = std::system((line + " > /dev/null").c_str());
  if (status == -1) throw Error(name + " could not be started");
  const int code = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  if (code == app::kInterrupted) throw Interrupted("interrupted; what had ended is on disk");
  return code;
}

}  // namespace sarnerf::bench

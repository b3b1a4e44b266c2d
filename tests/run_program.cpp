// SPDX-License-Identifier: Apache-2.0
#include "run_program.h"

#include <fcntl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <thread>

#include "scratch_folder.h"

namespace {

[[noreturn]] void become_program(const std::string& program, std::vector<std::string> arguments, const Conditions& conditions,
                                 const std::filesystem::path& out, const std::filesystem::path& err) {
  arguments.insert(arguments.begin(), program);
  std::vector<char*> argv;
  for (std::string& argument : arguments) argv.push_back(argument.data());
  argv.push_back(nullptr);
  const int out_fd = ::open(out.c_str(), O_WRONLY | O_CREAT, 0600);
  const int err_fd = ::open(err.c_str(), O_WRONLY | O_CREAT, 0600);
  if (::chdir(conditions.folder.c_str()) != 0 || ::dup2(out_fd, 1) < 0 || ::dup2(err_fd, 2) < 0) ::_exit(127);
  if (conditions.max_file_bytes > 0) {
    const auto bytes = static_cast<rlim_t>(conditions.max_file_bytes);
    const rlimit limit{bytes, bytes};
    ::setrlimit(RLIMIT_FSIZE, &limit);
  }
  if (conditions.before) conditions.before();
  ::execv(program.c_str(), argv.data());
  ::_exit(127);
}

}  // namespace

Outcome run_program(const std::string& program, const std::vector<std::string>& arguments, const Conditions& conditions) {
  const ScratchFolder streams;
  const auto out = conditions.out.empty() ? streams / "out" : conditions.out;
  const auto start = std::chrono::steady_clock::now();
  const auto age_s = [&] { return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count(); };
  const pid_t child = ::fork();
  if (child == 0) become_program(program, arguments, conditions, out, streams / "err");
  int status = 0;
  while (::waitpid(child, &status, conditions.signal ? WNOHANG : 0) == 0) {
    if (const int number = conditions.signal(age_s())) ::kill(child, number);
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  Outcome outcome;
  outcome.seconds = age_s();
  outcome.code = WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
  if (conditions.out.empty()) outcome.out = read_text(out);
  outcome.err = read_text(streams / "err");
  return outcome;
}

bool Outcome::is_error(const std::string& piece) const {
  constexpr const char* kError = ": error: ";
  const auto first = err.find(kError);
  if (first == std::string::npos || err.find(kError, first + 1) != std::string::npos || err.back() != '\n') return false;
  return err.find('\n', first) == err.size() - 1 && err.find(piece, first) != std::string::npos;
}

// SPDX-License-Identifier: Apache-2.0
#include "program.h"

#include <fcntl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <chrono>
#include <thread>

namespace {

[[noreturn]] void become_program(std::string program, std::vector<std::string> arguments,
                                 const Conditions& conditions, const std::filesystem::path& out,
                                 const std::filesystem::path& err) {
  std::vector<char*> argv;
  argv.push_back(program.data());
  for (std::string& argument : arguments) argv.push_back(argument.data());
  argv.push_back(nullptr);
  const int out_fd = ::open(out.c_str(), O_WRONLY | O_CREAT, 0600);
  const int err_fd = ::open(err.c_str(), O_WRONLY | O_CREAT, 0600);
  if (::chdir(conditions.folder.c_str()) != 0 || ::dup2(out_fd, 1) < 0 || ::dup2(err_fd, 2) < 0) {
    ::_exit(127);
  }
  if (conditions.max_file_bytes > 0) {
    const auto bytes = static_cast<rlim_t>(conditions.max_file_bytes);
    const rlimit limit{bytes, bytes};
    ::setrlimit(RLIMIT_FSIZE, &limit);
  }
  if (conditions.before) conditions.before();
  ::execv(program.c_str(), argv.data());
  ::_exit(127);
}

Outcome run_program(const std::string& program, const std::vector<std::string>& arguments,
                    const Conditions& conditions) {
  const ScratchFolder streams;
  const auto out = conditions.out.empty() ? streams / "out" : conditions.out;
  const pid_t child = ::fork();
  if (child == 0) become_program(program, arguments, conditions, out, streams / "err");
  int status = 0;
  while (::waitpid(child, &status, conditions.signal ? WNOHANG : 0) == 0) {
    if (const int signal = conditions.signal()) ::kill(child, signal);
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  Outcome outcome;
  outcome.code = WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
  if (conditions.out.empty()) outcome.out = read_text(out);
  outcome.err = read_text(streams / "err");
  return outcome;
}

}  // namespace

Outcome sar_render(const std::vector<std::string>& arguments, const Conditions& conditions) {
  return run_program(SAR_RENDER, arguments, conditions);
}

Outcome sar_bench(const std::vector<std::string>& arguments, const Conditions& conditions) {
  return run_program(SAR_BENCH, arguments, conditions);
}

#ifdef SAR_IMPORT
Outcome sar_import(const std::vector<std::string>& arguments, const Conditions& conditions) {
  return run_program(SAR_IMPORT, arguments, conditions);
}
#endif

SceneFolder::SceneFolder() {
  write_text(*this / "box.obj",
             "v -2 0 -1\nv 2 0 -1\nv 2 0 1\nv -2 0 1\nv -2 3 -1\nv 2 3 -1\nv 2 3 1\nv -2 3 1\n"
             "f 1 2 3 4\nf 8 7 6 5\nf 1 5 6 2\nf 2 6 7 3\nf 3 7 8 4\nf 4 8 5 1\n");
  write_text(*this / "shell.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
}

std::map<std::string, std::string> SceneFolder::contents(const std::filesystem::path& below) const {
  std::map<std::string, std::string> files;
  const std::filesystem::path root = path() / below;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(root)) {
    const std::string name = entry.path().lexically_relative(root).string();
    if (entry.is_regular_file() && !name.ends_with(".report.json")) {
      files[name] = read_text(entry.path());
    }
  }
  return files;
}

std::size_t n_images(const std::filesystem::path& dataset) {
  std::error_code code;
  std::size_t n = 0;
  for (const auto& entry : std::filesystem::directory_iterator(dataset / "images", code))
    n += entry.path().extension() == ".tif" ? 1 : 0;
  return n;
}

bool is_error_line(const std::string& text, const std::string& piece) {
  return text.starts_with("sar_render: error: ") && std::count(text.begin(), text.end(), '\n') == 1 &&
         text.back() == '\n' && text.find(piece) != std::string::npos;
}

// SPDX-License-Identifier: Apache-2.0
#include "program.h"

#include <algorithm>

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

std::map<std::string, std::string> contents_of(const std::filesystem::path& folder) {
  std::map<std::string, std::string> files;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
    const std::string name = entry.path().lexically_relative(folder).string();
    if (entry.is_regular_file() && !name.ends_with(".report.json")) files[name] = read_text(entry.path());
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
         text.back() == '\n' && has(text, piece);
}

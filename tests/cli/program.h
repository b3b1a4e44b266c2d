// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "run_program.h"
#include "scratch_folder.h"

/// Run a program with these arguments to its end.
Outcome sar_render(const std::vector<std::string>& arguments, const Conditions& conditions);
Outcome sar_bench(const std::vector<std::string>& arguments, const Conditions& conditions);
Outcome sar_import(const std::vector<std::string>& arguments, const Conditions& conditions);

/// Names and contents of all files below a folder, but for reports, which hold times.
std::map<std::string, std::string> contents_of(const std::filesystem::path& folder);

/// A folder with box.obj: a closed box of 4 × 3 × 2 m (x, y, z) on y = 0, and shell.obj, one triangle.
class SceneFolder : public ScratchFolder {
 public:
  SceneFolder();
  Outcome run(const std::vector<std::string>& arguments) const { return sar_render(arguments, {path()}); }

  /// Names and contents of all files below.
  std::map<std::string, std::string> contents(const std::filesystem::path& below = {}) const { return contents_of(*this / below); }
};

/// Number of images of a dataset, which need not be complete.
std::size_t n_images(const std::filesystem::path& dataset);

/// Whether the text is one line that starts as the program's errors do and holds the piece.
bool is_error_line(const std::string& text, const std::string& piece);

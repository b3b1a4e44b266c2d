// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "scratch_folder.h"

/// What a finished program left behind.
struct Outcome {
  int code = -1;  ///< exit code, or minus the signal that ended it
  std::string out, err;
};

/// How a program is run.
struct Conditions {
  std::filesystem::path folder;      ///< it starts here
  long max_file_bytes = 0;           ///< files end here, as on a full disk; 0: no limit
  std::filesystem::path out;         ///< stdout goes here instead of into Outcome
  /// Asked every millisecond while the program runs; the signal it returns is sent (0: none).
  std::function<int()> signal;
  /// Called by the program's process in its folder, before it starts.
  std::function<void()> before;
};

/// Runs a program with these arguments to its end.
Outcome sar_render(const std::vector<std::string>& arguments, const Conditions& conditions);
Outcome sar_bench(const std::vector<std::string>& arguments, const Conditions& conditions);
Outcome sar_import(const std::vector<std::string>& arguments, const Conditions& conditions);

/// A folder with box.obj: a closed box of 4 × 3 × 2 m (x, y, z) on y = 0, and shell.obj, one triangle.
class SceneFolder : public ScratchFolder {
 public:
  SceneFolder();
  Outcome run(const std::vector<std::string>& arguments) const {
    return sar_render(arguments, {path(), 0, {}, {}, {}});
  }

  /// Names and contents of all files below, but for reports, which hold times.
  std::map<std::string, std::string> contents(const std::filesystem::path& below = {}) const;
};

/// Whether the text holds the piece.
inline bool has(const std::string& text, const std::string& piece) { return text.find(piece) != std::string::npos; }

/// The arguments, and more behind them.
inline std::vector<std::string> with(std::vector<std::string> arguments, const std::vector<std::string>& more) {
  arguments.insert(arguments.end(), more.begin(), more.end());
  return arguments;
}

/// Number of images of a dataset, which need not be complete.
std::size_t n_images(const std::filesystem::path& dataset);

/// Whether the text is one line that starts as the program's errors do and holds the piece.
bool is_error_line(const std::string& text, const std::string& piece);

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

/// What a finished program left behind.
struct Outcome {
  int code = -1;  ///< exit code, or minus the signal that ended it
  std::string out, err;
  double seconds = 0.0;

  /// Whether stderr's last line is an error of the program that holds the piece, and its only error.
  bool is_error(const std::string& piece) const;
};

/// Asked every millisecond while a program runs, with its age; the signal it returns is sent (0: none).
using Signal = std::function<int(double age_s)>;

/// How a program is run.
struct Conditions {
  std::filesystem::path folder;  ///< it starts here
  Signal signal = {};
  long max_file_bytes = 0;             ///< files end here, as on a full disk; 0: no limit
  std::filesystem::path out = {};      ///< stdout goes here instead of into Outcome
  std::function<void()> before = {};   ///< called by the program's process in its folder, before it starts
};

/// Runs a program with these arguments to its end.
Outcome run_program(const std::string& program, const std::vector<std::string>& arguments, const Conditions& conditions);

/// Whether the text holds the piece.
inline bool has(const std::string& text, const std::string& piece) { return text.find(piece) != std::string::npos; }

/// The arguments, and more behind them.
inline std::vector<std::string> with(std::vector<std::string> arguments, const std::vector<std::string>& more) {
  arguments.insert(arguments.end(), more.begin(), more.end());
  return arguments;
}

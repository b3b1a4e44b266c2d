// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "sarnerf/core/image.h"

namespace sarnerf {

/// Variables of a MATLAB file of version 5, by name. Every complaint is an InputError that names file and variable.
class MatFile {
 public:
  explicit MatFile(const std::filesystem::path& path);
  ~MatFile();

  double number(const char* name) const;     ///< finite
  std::string text(const char* name) const;  ///< in one line

  /// Absolute values of a complex or real matrix in the order of the file: rows of the image are the matrix's columns.
  Image<float> magnitudes(const char* name) const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace sarnerf

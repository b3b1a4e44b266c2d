// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <matio.h>

#include <filesystem>
#include <map>
#include <stdexcept>
#include <string>
#include <vector>

namespace sarnerf::test {

/// A MATLAB file as SAMPLE has them: numbers by name, a target's name and an n_rows × n_columns matrix whose element
/// (row, column), both from 0, is (row + 1) + 10 (column + 1) i.
struct SampleFile {
  std::map<std::string, double> numbers{{"azimuth", 11.22484},
                                        {"elevation", 15.04},
                                        {"range_pixel_spacing", 0.202148},
                                        {"xrange_pixel_spacing", 0.203125}};
  std::string target_name = "2s1_gun";
  std::size_t n_rows = 3, n_columns = 4;
  bool with_image = true;
  bool compressed = true;
  mat_ft version = MAT_FT_MAT5;

  void write(const std::filesystem::path& path) const {
    mat_t* const file = Mat_CreateVer(path.c_str(), nullptr, version);
    if (file == nullptr) throw std::runtime_error("libmatio cannot create " + path.string());
    const auto add = [&](matvar_t* variable) {
      Mat_VarWrite(file, variable, compressed ? MAT_COMPRESSION_ZLIB : MAT_COMPRESSION_NONE);
      Mat_VarFree(variable);
    };
    std::size_t one[] = {1, 1};
    for (const auto& [name, value] : numbers) {
      double copy = value;
      add(Mat_VarCreate(name.c_str(), MAT_C_DOUBLE, MAT_T_DOUBLE, 2, one, &copy, 0));
    }
    if (!target_name.empty()) {
      std::string copy = target_name;
      std::size_t line[] = {1, copy.size()};
      add(Mat_VarCreate("target_name", MAT_C_CHAR, MAT_T_UTF8, 2, line, copy.data(), 0));
    }
    if (with_image) {
      std::vector<double> real, imaginary;
      for (std::size_t column = 0; column < n_columns; ++column) {
        for (std::size_t row = 0; row < n_rows; ++row) {
          real.push_back(static_cast<double>(row + 1));
          imaginary.push_back(10.0 * static_cast<double>(column + 1));
        }
      }
      mat_complex_split_t parts{real.data(), imaginary.data()};
      std::size_t size[] = {n_rows, n_columns};
      add(Mat_VarCreate("complex_img", MAT_C_DOUBLE, MAT_T_DOUBLE, 2, size, &parts, MAT_F_COMPLEX));
    }
    Mat_Close(file);
  }
};

}  // namespace sarnerf::test

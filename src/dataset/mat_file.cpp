// SPDX-License-Identifier: Apache-2.0
#include "mat_file.h"

#include <matio.h>

#include <cmath>
#include <cstring>

#include "mat_layout.h"
#include "sarnerf/core/error.h"
#include "sarnerf/core/input_file.h"
#include "sarnerf/core/input_text.h"

namespace sarnerf {
namespace {

[[noreturn]] void fail(const std::string& where, const std::string& what) {
  throw InputError(where + ": " + what);
}

struct FreeVariable {
  void operator()(matvar_t* variable) const { Mat_VarFree(variable); }
};
using Variable = std::unique_ptr<matvar_t, FreeVariable>;

}  // namespace

struct MatFile::State {
  std::string where;
  mat_t* file = nullptr;

  std::string place(const char* name) const { return where + ": " + name; }

  /// With its data, after looking at its shape.
  Variable read(const char* name, bool (*is_right)(const matvar_t&), const char* expected) const {
    const Variable shape(Mat_VarReadInfo(file, name));
    if (!shape)
      fail(where, std::string("the file has no variable ") + name + ", expected one of SAMPLE's");
    if (shape->rank != 2 || !is_right(*shape))
      fail(place(name), std::string("expected ") + expected);
    Variable whole(Mat_VarRead(file, name));
    if (!whole || whole->data == nullptr || whole->rank != 2 || !is_right(*whole))
      fail(place(name), "the variable's data is damaged");
    return whole;
  }
};

MatFile::MatFile(const std::filesystem::path& path) : state_(std::make_unique<State>()) {
  state_->where = path.string();
  check_mat_layout(read_whole_file(path), state_->where);
  state_->file = Mat_Open(path.c_str(), MAT_ACC_RDONLY);
  if (state_->file == nullptr) fail(state_->where, "the MATLAB file cannot be read");
}

MatFile::~MatFile() {
  if (state_->file != nullptr) Mat_Close(state_->file);
}

double MatFile::number(const char* name) const {
  const auto is_scalar = [](const matvar_t& v) {
    return v.class_type == MAT_C_DOUBLE && v.isComplex == 0 && v.dims[0] == 1 && v.dims[1] == 1;
  };
  const Variable variable = state_->read(name, is_scalar, "one number of double precision");
  double value = 0.0;
  if (variable->nbytes != sizeof value) fail(state_->place(name), "the variable's data is damaged");
  std::memcpy(&value, variable->data, sizeof value);
  if (!std::isfinite(value)) fail(state_->place(name), "expected a finite number");
  return value;
}

std::string MatFile::text(const char* name) const {
  const auto is_line = [](const matvar_t& v) {
    return v.class_type == MAT_C_CHAR && v.dims[0] == 1 && v.dims[1] >= 1 && v.dims[1] <= 4096;
  };
  const Variable variable = state_->read(name, is_line, "a text");
  const auto length = static_cast<std::size_t>(variable->dims[1]);
  const auto width = variable->nbytes / length;  // 8-bit codes, or the first halves of 16-bit ones
  std::string text;
  for (std::size_t n = 0; n < length && (width == 1 || width == 2); ++n)
    text += static_cast<const char*>(variable->data)[n * width];
  return in_one_line(text, 60);
}

Image<float> MatFile::magnitudes(const char* name) const {
  const auto is_matrix = [](const matvar_t& v) {
    return (v.class_type == MAT_C_DOUBLE || v.class_type == MAT_C_SINGLE) && v.dims[0] >= 1 &&
           v.dims[1] >= 1;
  };
  const Variable variable = state_->read(name, is_matrix, "a matrix of complex numbers");
  const bool is_double = variable->class_type == MAT_C_DOUBLE;
  const std::size_t n_pixels = variable->dims[0] * variable->dims[1];
  if (variable->nbytes != n_pixels * (is_double ? sizeof(double) : sizeof(float)))
    fail(state_->place(name), "the variable's data is damaged");
  const void *real = variable->data, *imaginary = nullptr;
  if (variable->isComplex != 0) {
    const auto* const parts = static_cast<const mat_complex_split_t*>(variable->data);
    real = parts->Re;
    imaginary = parts->Im;
    if (real == nullptr || imaginary == nullptr)
      fail(state_->place(name), "the variable's data is damaged");
  }
  const auto value = [&](const void* part, std::size_t n) {
    if (part == nullptr) return 0.0;
    return is_double ? static_cast<const double*>(part)[n]
                     : double{static_cast<const float*>(part)[n]};
  };
  Image<float> image(static_cast<int>(variable->dims[1]), static_cast<int>(variable->dims[0]));
  for (std::size_t n = 0; n < n_pixels; ++n) {
    const auto magnitude = static_cast<float>(std::hypot(value(real, n), value(imaginary, n)));
    if (!std::isfinite(magnitude)) fail(state_->place(name), "a pixel is not finite");
    image.pixels()[n] = magnitude;
  }
  return image;
}

}  // namespace sarnerf

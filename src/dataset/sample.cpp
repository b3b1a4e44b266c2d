// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include <matio.h>
#include <zlib.h>

#include "sarnerf/core/error.h"
#include "sarnerf/core/files.h"
#include "sarnerf/core/image.h"
#include "sarnerf/core/text.h"
#include "sarnerf/dataset/image_index.h"
#include "sarnerf/dataset/posed_image.h"

namespace sarnerf {

namespace {

constexpr std::size_t kHeaderBytes = 128, kTagBytes = 8;
constexpr std::uint32_t kInt8 = 1, kInt32 = 5, kUint32 = 6, kMatrix = 14, kCompressed = 15,
                        kUtf8 = 16, kUtf32 = 18, kComplexFlag = 0x800;

constexpr std::uint32_t kMostSide = 2048, kLongestName = 63;

/// Real and imaginary parts in double precision, and the bytes around them.
constexpr std::size_t kMostMatrixBytes = 2 * sizeof(double) * kMostSide * kMostSide + 1024;

/// Accepted array classes: texts and numbers of every kind; not cells, structures, objects, sparse matrices.
constexpr std::uint32_t kCharacters = 4, kFirstNumber = 6, kLastNumber = 15;

class Words {
 public:
  Words(std::string_view bytes, bool little_endian)
      : bytes_(bytes), little_endian_(little_endian) {}

  std::uint32_t at(std::size_t place) const {
    std::uint32_t value = 0;
    for (std::size_t n = 0; n < 4; ++n)
      value = value << 8 | static_cast<unsigned char>(bytes_[place + (little_endian_ ? 3 - n : n)]);
    return value;
  }

 private:
  std::string_view bytes_;
  bool little_endian_;
};

/// The uncompressed bytes of a variable; empty if it cannot be uncompressed or is too large.
std::string unzipped(std::string_view zipped) {
  std::string bytes(std::min(kMostMatrixBytes, 1032 * zipped.size() + 64),
                    '\0');  // zlib's highest ratio
  auto n_bytes = static_cast<uLongf>(bytes.size());
  const int result =
      uncompress(reinterpret_cast<Bytef*>(bytes.data()), &n_bytes,
                 reinterpret_cast<const Bytef*>(zipped.data()), static_cast<uLong>(zipped.size()));
  bytes.resize(result == Z_OK ? n_bytes : 0);
  return bytes;
}

/// Bytes of one value of a data type; 0 if the type is neither a number nor a character.
std::size_t size_of(std::uint32_t type) {
  constexpr std::array<std::size_t, 19> kSizes{0, 1, 1, 2, 2, 4, 4, 4, 0, 8,
                                               0, 0, 8, 8, 0, 0, 1, 2, 4};
  return type < kSizes.size() ? kSizes[type] : 0;
}

struct Part {
  std::uint32_t type = 0;
  std::size_t begin = 0, n_bytes = 0;
};

/// The parts of a matrix, in order. Small parts have type and size in one word and their data in the next; others are
/// padded to a multiple of eight bytes. Empty if the last part does not end with the matrix.
std::vector<Part> parts_of(std::string_view matrix, const Words& words) {
  std::vector<Part> parts;
  for (std::size_t at = kTagBytes; at < matrix.size();) {
    if (matrix.size() - at < kTagBytes || parts.size() == 5) return {};
    const std::uint32_t word = words.at(at);
    const bool small = (word >> 16) != 0;
    const Part part{word & 0xffff, at + (small ? 4 : 8), small ? word >> 16 : words.at(at + 4)};
    if (part.n_bytes > (small ? 4 : matrix.size() - at - kTagBytes)) return {};
    at += kTagBytes + (small ? 0 : (part.n_bytes + 7) / 8 * 8);
    parts.push_back(part);
  }
  return parts;
}

bool is_plain_matrix(std::string_view matrix, bool little_endian) {
  const Words words(matrix, little_endian);
  if (matrix.size() < kTagBytes || words.at(0) != kMatrix ||
      words.at(4) != matrix.size() - kTagBytes)
    return false;
  const std::vector<Part> parts = parts_of(matrix, words);
  if (parts.size() < 4) return false;
  const Part &flags = parts[0], &sides = parts[1], &name = parts[2];
  if (flags.type != kUint32 || flags.n_bytes != 8 || sides.type != kInt32 || sides.n_bytes != 8 ||
      name.type != kInt8 || name.n_bytes > kLongestName)
    return false;
  const std::uint32_t array_class = words.at(flags.begin) & 0xff;
  const bool is_text = array_class == kCharacters,
             is_complex = (words.at(flags.begin) & kComplexFlag) != 0;
  if (!is_text && !(array_class >= kFirstNumber && array_class <= kLastNumber)) return false;
  const std::uint32_t n_rows = words.at(sides.begin), n_columns = words.at(sides.begin + 4);
  if (n_rows > kMostSide || n_columns > kMostSide || parts.size() != (is_complex ? 5u : 4u))
    return false;
  return std::all_of(parts.begin() + 3, parts.end(), [&](const Part& data) {
    const std::size_t n_values = std::size_t{n_rows} * n_columns, size = size_of(data.type);
    // A character of UTF-8 has up to four bytes.
    if (is_text && data.type == kUtf8)
      return data.n_bytes >= n_values && data.n_bytes <= 4 * n_values;
    return size > 0 && data.type < (is_text ? kUtf32 + 1 : kUtf8) &&
           data.n_bytes == size * n_values;
  });
}

/// Checks the bytes of a MATLAB file before libmatio reads it, which trusts any size it finds. Accepts files of version 5
/// that end with their last variable and hold only texts and matrices of numbers of at most 2048 × 2048, compressed or
/// not, whose parts have the required lengths. Throws InputError "where: …" for all others; the message names version
/// 7.3 (HDF5). Cost: uncompressing the compressed variables, one at a time.
void check_mat_layout(std::string_view file, const std::string& where) {
  const auto fail = [&](const std::string& what) { throw InputError(where + ": " + what); };
  if (file.starts_with("\x89HDF\r\n") || file.starts_with("MATLAB 7.3"))
    fail(
        "this is a MATLAB file of version 7.3 (HDF5), which is not read; save it with -v7 in "
        "MATLAB");
  if (!file.starts_with("MATLAB 5.0") || file.size() < kHeaderBytes)
    fail("expected a MATLAB file of version 5, which begins with MATLAB 5.0");
  const std::string_view order = file.substr(kHeaderBytes - 2, 2);
  if (order != "IM" && order != "MI")
    fail("the header of the MATLAB file is damaged: no byte order");
  const bool little_endian = order == "IM";
  if (file.substr(kHeaderBytes - 4, 2) !=
      (little_endian ? std::string_view("\0\1", 2) : std::string_view("\1\0", 2)))
    fail("the header of the MATLAB file is damaged: expected version 0x0100");
  const Words words(file, little_endian);
  for (std::size_t at = kHeaderBytes; at < file.size();) {
    if (file.size() - at < kTagBytes)
      fail("the file is truncated in the middle of a variable's tag");
    const std::uint32_t type = words.at(at), n_bytes = words.at(at + 4);
    const std::size_t end = at + kTagBytes + n_bytes;
    if (type != kMatrix && type != kCompressed)
      fail("byte " + std::to_string(at) + ": expected a variable; the file is damaged");
    if (end > file.size())
      fail("the file is truncated: a variable ends at byte " + std::to_string(end) +
           ", the file at byte " + std::to_string(file.size()));
    const std::string_view element = file.substr(at, end - at);
    const bool plain = type == kMatrix
                           ? is_plain_matrix(element, little_endian)
                           : is_plain_matrix(unzipped(element.substr(kTagBytes)), little_endian);
    if (!plain)
      fail("the variable at byte " + std::to_string(at) + " is no text and no matrix of at most " +
           std::to_string(kMostSide) + " x " + std::to_string(kMostSide) + " numbers, or damaged");
    at = end;
  }
}

[[noreturn]] void fail(const std::string& where, const std::string& what) {
  throw InputError(where + ": " + what);
}

struct FreeVariable {
  void operator()(matvar_t* variable) const { Mat_VarFree(variable); }
};
using Variable = std::unique_ptr<matvar_t, FreeVariable>;

/// Variables of a MATLAB file of version 5, by name. Every error is an InputError that names file and variable.
class MatFile {
 public:
  explicit MatFile(const std::filesystem::path& path);
  ~MatFile();

  double number(const char* name) const;     ///< finite
  std::string text(const char* name) const;  ///< in one line

  /// Absolute values of a complex or real matrix, in the order of the file: the image's rows are the matrix's columns.
  Image<float> magnitudes(const char* name) const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

struct MatFile::State {
  std::string where;
  mat_t* file = nullptr;

  std::string place(const char* name) const { return where + ": " + name; }

  /// Reads a variable with its data, after checking its shape.
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
  const auto width = variable->nbytes / length;  // 8-bit codes, or the first bytes of 16-bit ones
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

/// "b01" of "2s1_real_A_elevDeg_015_azCenter_011_22_serial_b01".
std::string serial_of(const std::string& stem) {
  constexpr std::string_view kMark = "_serial_";
  const std::size_t at = stem.rfind(kMark);
  return at == std::string::npos ? "" : in_one_line(stem.substr(at + kMark.size()), 60);
}

double positive(const MatFile& file, const char* name, const std::filesystem::path& path) {
  const double value = file.number(name);
  if (!(value > 0.0)) throw InputError(path.string() + ": " + name + ": expected a number above 0");
  return value;
}

}  // namespace

Chip read_sample(const std::filesystem::path& path, double assumed_range_m) {
  const MatFile file(path);
  PhoenixChip chip;
  chip.target_azimuth_deg = file.number("azimuth");
  chip.measured_depression_deg = file.number("elevation");
  if (!is_depression(*chip.measured_depression_deg))
    throw InputError(path.string() +
                     ": elevation: expected degrees between 0 and 90, both excluded");
  chip.range_spacing_m = positive(file, "range_pixel_spacing", path);
  chip.cross_range_spacing_m = positive(file, "xrange_pixel_spacing", path);
  chip.target_type = file.text("target_name");
  chip.target_serial = serial_of(path.stem().string());
  chip.file_name = path.filename().string();
  // MATLAB stores a matrix by columns: read by rows, it is already transposed.
  chip.magnitude = file.magnitudes("complex_img");
  return chip_of(chip, assumed_range_m);
}

}  // namespace sarnerf

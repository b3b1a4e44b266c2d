// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace sarnerf {

/// A SAR image in memory: rows are azimuth rows i, columns are slant-range bins j (near to far).
template <class T>
class Image {
 public:
  Image() = default;
  Image(int n_azimuth, int n_range, T value = T{})
      : n_azimuth_(n_azimuth),
        n_range_(n_range),
        pixels_(static_cast<std::size_t>(n_azimuth) * static_cast<std::size_t>(n_range), value) {}

  int n_azimuth() const { return n_azimuth_; }
  int n_range() const { return n_range_; }

  T& operator()(int i, int j) { return pixels_[index(i, j)]; }
  const T& operator()(int i, int j) const { return pixels_[index(i, j)]; }

  std::span<T> row(int i) { return std::span(pixels_).subspan(index(i, 0), width()); }
  std::span<const T> row(int i) const { return std::span(pixels_).subspan(index(i, 0), width()); }

  std::span<T> pixels() { return pixels_; }
  std::span<const T> pixels() const { return pixels_; }

 private:
  std::size_t width() const { return static_cast<std::size_t>(n_range_); }
  std::size_t index(int i, int j) const {
    return static_cast<std::size_t>(i) * width() + static_cast<std::size_t>(j);
  }

  int n_azimuth_ = 0;
  int n_range_ = 0;
  std::vector<T> pixels_;
};

}  // namespace sarnerf

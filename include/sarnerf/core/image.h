// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
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

/// The middle `n_azimuth` × `n_range` pixels, which the image must have. Where it has an odd number of pixels more, the middle moves by
/// half a pixel.
template <class T>
Image<T> middle_of(const Image<T>& whole, int n_azimuth, int n_range) {
  const int first_row = (whole.n_azimuth() - n_azimuth) / 2, first_bin = (whole.n_range() - n_range) / 2;
  Image<T> middle(n_azimuth, n_range);
  for (int i = 0; i < n_azimuth; ++i) std::copy_n(whole.row(first_row + i).begin() + first_bin, n_range, middle.row(i).begin());
  return middle;
}

/// Bilinear interpolation at a position in pixels. Whole numbers are pixel centres; pixels beyond the border are 0.
/// Returns 0 where the position is NaN.
inline double bilinear(const Image<float>& image, double i, double j) {
  if (!(i > -1.0 && i < image.n_azimuth() && j > -1.0 && j < image.n_range())) return 0.0;
  const int i0 = static_cast<int>(std::floor(i)), j0 = static_cast<int>(std::floor(j));
  const double wi[2] = {1.0 - (i - i0), i - i0}, wj[2] = {1.0 - (j - j0), j - j0};
  double sum = 0.0;
  for (int a = 0; a < 2; ++a) {
    if (i0 + a < 0 || i0 + a >= image.n_azimuth()) continue;
    for (int b = 0; b < 2; ++b) {
      if (j0 + b < 0 || j0 + b >= image.n_range()) continue;
      sum += wi[a] * wj[b] * double{image(i0 + a, j0 + b)};
    }
  }
  return sum;
}

/// Cubic convolution (Keys 1981, IEEE TASSP 29(6), a = −1/2; the spline of Catmull and Rom) at a position in pixels. Whole numbers are pixel
/// centres; pixels beyond the border are 0, so that values reach two pixels beyond it. Exact for polynomials of degree 2 where all 4 × 4 pixels
/// are inside; beside an edge it overshoots, below 0 too. Returns 0 where the position is NaN.
inline double cubic(const Image<float>& image, double i, double j) {
  if (!(i > -2.0 && i < image.n_azimuth() + 1.0 && j > -2.0 && j < image.n_range() + 1.0)) return 0.0;
  const auto weights = [](double t, double (&w)[4]) {
    w[0] = t * (-0.5 + t * (1.0 - 0.5 * t));
    w[1] = 1.0 + t * t * (-2.5 + 1.5 * t);
    w[2] = t * (0.5 + t * (2.0 - 1.5 * t));
    w[3] = t * t * (-0.5 + 0.5 * t);
  };
  const int i0 = static_cast<int>(std::floor(i)), j0 = static_cast<int>(std::floor(j));
  double wi[4], wj[4];
  weights(i - i0, wi);
  weights(j - j0, wj);
  double sum = 0.0;
  for (int a = 0; a < 4; ++a) {
    const int row = i0 - 1 + a;
    if (row < 0 || row >= image.n_azimuth()) continue;
    for (int b = 0; b < 4; ++b) {
      const int bin = j0 - 1 + b;
      if (bin >= 0 && bin < image.n_range()) sum += wi[a] * wj[b] * double{image(row, bin)};
    }
  }
  return sum;
}

}  // namespace sarnerf

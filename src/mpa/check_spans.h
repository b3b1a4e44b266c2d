// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <string>

#include "sarnerf/core/error.h"
#include "sarnerf/mpa/integrate.h"

namespace sarnerf {

inline void expect_length(std::size_t found, std::size_t expected, const char* what) {
  if (found != expected) {
    throw UsageError(std::string("integrate: ") + what + " has " + std::to_string(found) +
                     " values, expected " + std::to_string(expected));
  }
}

/// Throws UsageError unless the arrays fit together. Cost: one pass over the rays, none over the segments.
template <class T>
void check_segments(const SegmentSpans<T>& segments, const FieldSamples<T>& field) {
  const std::size_t n_rays = segments.ray_row.size();
  const std::size_t n_segments = segments.bin.size();
  expect_length(segments.ray_begin.size(), n_rays + 1, "ray_begin");
  expect_length(segments.length_m.size(), n_segments, "length_m");
  expect_length(field.extinction_per_m.size(), n_segments, "extinction_per_m");
  expect_length(field.source.size(), n_segments, "source");
  if (!field.extinction_back_per_m.empty()) {
    expect_length(field.extinction_back_per_m.size(), n_segments, "extinction_back_per_m");
  }
  // The rays may be a subset of those whose segments the arrays hold.
  if (segments.ray_begin.back() > n_segments) {
    throw UsageError("integrate: ray_begin ends at segment " +
                     std::to_string(segments.ray_begin.back()) + " of " +
                     std::to_string(n_segments));
  }
  if (!std::is_sorted(segments.ray_begin.begin(), segments.ray_begin.end())) {
    throw UsageError("integrate: ray_begin must not decrease");
  }
}

/// The same; in addition every ray's row must lie in the image. The kernels treat a bin beyond it as kNoBin.
template <class T>
void check_spans(const SegmentSpans<T>& segments, const FieldSamples<T>& field, int n_range,
                 std::size_t n_pixels) {
  check_segments(segments, field);
  if (n_range < 0) throw UsageError("integrate: n_range is " + std::to_string(n_range));
  std::uint32_t last_row = 0;
  for (const std::uint32_t row : segments.ray_row) last_row = std::max(last_row, row);
  if (!segments.ray_row.empty() && (last_row + std::size_t{1}) * static_cast<std::size_t>(n_range) > n_pixels) {
    throw UsageError("integrate: a ray belongs to row " + std::to_string(last_row) + " of " +
                     std::to_string(n_range) + " bins, but the image has only " +
                     std::to_string(n_pixels) + " pixels");
  }
}

template <class T>
void check_gradients(const FieldSamples<T>& field, const FieldGradients<T>& gradients) {
  expect_length(gradients.source.size(), field.source.size(), "gradient of source");
  expect_length(gradients.extinction_per_m.size(), field.extinction_per_m.size(),
                "gradient of extinction_per_m");
  expect_length(gradients.extinction_back_per_m.size(), field.extinction_back_per_m.size(),
                "gradient of extinction_back_per_m");
}

}  // namespace sarnerf

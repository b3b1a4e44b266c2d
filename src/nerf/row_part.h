// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "sarnerf/geometry/ray_grid.h"
#include "sarnerf/mpa/volume_march.h"

namespace sarnerf {

/// The segments of some azimuth rows that one thread renders, one row behind the other, and its memory.
struct RowPart {
  struct Row {
    Acquisition acquisition;
    int row;
    Fan fan;
    std::size_t first_ray, end_ray;
  };
  SampleBatch batch;
  BatchField field;
  std::vector<Row> rows;
  std::vector<std::uint32_t> ray_k;  ///< of all rays: their places in the fans

  std::vector<double> of_pixel;               ///< a row's pixels, or their gradients
  std::vector<float> d_extinction, d_source;  ///< gradients of all segments
  std::vector<float> d_values;                ///< of the grid's values, where several threads add to them

  void clear() {
    batch.clear();
    field.clear();
    rows.clear();
    ray_k.clear();
  }
  /// What is appended to the batch in between are the rays of one row.
  void begin_row(const Acquisition& acquisition, int row) {
    rows.push_back({acquisition, row, {}, batch.n_rays(), batch.n_rays()});
  }
  void end_row(const Fan& fan) {
    Row& row = rows.back();
    row.fan = fan;
    row.end_ray = batch.n_rays();
  }

  std::uint32_t first_segment(const Row& row) const { return batch.ray_begin[row.first_ray]; }
  std::uint32_t end_segment(const Row& row) const { return batch.ray_begin[row.end_ray]; }

  /// Rays and segments of a row, as the integrators take them: ray_begin counts from the batch's first segment.
  SegmentSpans<float> segments(const Row& row) const {
    SegmentSpans<float> s = spans(batch);
    s.ray_begin = s.ray_begin.subspan(row.first_ray, row.end_ray - row.first_ray + 1);
    s.ray_row = s.ray_row.subspan(row.first_ray, row.end_ray - row.first_ray);
    return s;
  }
};

}  // namespace sarnerf

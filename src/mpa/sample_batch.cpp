// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/mpa/sample_batch.h"

namespace sarnerf {

void SampleBatch::clear() {
  ray_begin.assign(1, 0);
  ray_row.clear();
  ray_elevation.clear();
  ray_direction.clear();
  bin.clear();
  length_m.clear();
  point_m.clear();
}

SegmentSpans<float> spans(const SampleBatch& batch) {
  return {batch.ray_begin, batch.ray_row, batch.bin, batch.length_m};
}

}  // namespace sarnerf

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "sarnerf/field/brick_grid.h"
#include "sarnerf/field/field_sampler.h"
#include "sarnerf/geometry/ray_grid.h"
#include "sarnerf/mpa/integrate.h"

namespace sarnerf {

/// Part of a ray, as range offsets s = t − r (m).
struct RangeInterval {
  double near_m = 0.0;
  double far_m = 0.0;
  bool empty() const { return !(near_m < far_m); }
};

/// The part of a ray (along-track coordinate a, elevation k) inside a box that is given relative to the aim point.
RangeInterval clip_to_box(const RayGrid& grid, double along_track_m, int k,
                          const Box& box_from_aim);

/// Opens a ray in the batch; segments appended until the next call belong to it.
void begin_ray(SampleBatch& batch, const RayGrid& grid, int row, int k);

/// Calls f(j, near, far) for the part of [near, far), in bin coordinates, in each bin j, in ascending order; j may be
/// negative.
template <class F>
void for_each_bin_part(double near, double far, F&& f) {
  while (near < far) {
    const double j = std::floor(near), end = std::min(j + 1.0, far);
    f(j, near, end);
    near = end;
  }
}

/// Rules for cutting intervals of a ray into segments.
struct BinCut {
  double longest = std::numeric_limits<double>::infinity();  ///< longest segment, in bins
  double gap = 0.0;  ///< parts of a bin up to this length (bins) are left out
};

/// Cuts [near, far) of a ray, in bin coordinates, at the borders of the range bins, and the parts evenly until none is longer
/// than allowed. Appends a segment for each part, with its centre point, and the bin coordinate of its near end to
/// `near_bin`. Parts nearer than bin 0 are cut at the same pitch and get kNoBin. Parts behind the last bin are not removed:
/// they reach no pixel, so callers limit `far` to the number of bins. Throws UsageError beyond 4294967295 segments.
void append_bins(SampleBatch& batch, std::vector<double>& near_bin, const RayGrid& grid, double along_track_m, int k,
                 double near, double far, const BinCut& how);

/// Two-way optical depth at which rays end: segments behind it keep less than 2.1e-9 of their power.
inline constexpr double kEndOfRayDepth = 20.0;

/// The field at the segments of a batch, in the same order.
struct BatchField {
  std::vector<float> extinction_per_m;
  std::vector<float> extinction_back_per_m;  ///< empty unless the field has it
  std::vector<float> source;
  std::vector<double> near_bin;  ///< bin coordinate at which the segment begins; bin j covers [j, j + 1)

  void clear();
};

/// The form in which integrate() takes a field's source.
SourceForm source_form(SourceBasis basis);

/// The field as integrate() takes it.
FieldSamples<float> samples(const BatchField& field, SourceBasis basis);

/// A ray of a RayGrid, at along-track coordinate a (m) and elevation k. `row` is its image row in the batch, `inside` the part
/// of it inside the field.
struct MarchRay {
  double along_track_m = 0.0;
  int row = 0;
  int k = 0;
  RangeInterval inside{};
  int slice = 0;  ///< of its azimuth row
  int place = 0;  ///< index among the rays of its slice
};

/// Cuts rays into segments where a sparse volume is occupied, and samples it only there. Empty bricks and tiles
/// are stepped over. A ray ends at the given optical depth, or a bin and some segments behind the last bin. Several
/// rays are marched together, so that the voxels of one are fetched from memory while others are processed.
/// Used for rendering and for training. One per thread; the grid and the occupancy must outlive it.
class VolumeMarcher {
 public:
  /// `grid`: its transform is relative to the aim point. `longest_m`: longest segment, about a voxel at most. Rays end
  /// at a two-way optical depth of `end_depth`: segments behind it keep e^−end_depth of their power.
  VolumeMarcher(const BrickView<const float>& grid, const FieldChannels& channels,
                const Occupancy& occupancy, double longest_m, double end_depth = kEndOfRayDepth);
  ~VolumeMarcher();
  VolumeMarcher(VolumeMarcher&&) noexcept;

  /// Appends rays to the batch in their order, with their segments. `depth`, if not empty, receives the two-way optical
  /// depth of each ray: at `end_depth` or more, the rest of the ray was left out. Segments do not depend on which rays
  /// are marched together. Cost: a few ns for each empty block, brick or tile, 40 to 60 ns a segment.
  void march(const RayGrid& rays, std::span<const MarchRay> some, SampleBatch& batch, BatchField& field,
             std::span<double> depth = {});

 private:
  struct Ray;
  struct Packet;

  void begin(const RayGrid& rays, const MarchRay& which, Ray& ray) const;
  /// The next run of occupied cells, at most some segments long; empty where the ray ends.
  RangeInterval next_run(Ray& ray);
  /// Cuts a run at the borders of bins, and where a segment would be too long; returns the number of its segments.
  std::size_t cut(Ray& ray, const RangeInterval& run, Packet& packet) const;
  /// Samples the packet's segments from `first` on.
  void sample(std::size_t first, Packet& packet);
  void march_packet(const RayGrid& rays, std::span<const MarchRay> some, SampleBatch& batch, BatchField& field);

  GridTransform transform_;
  FieldChannels channels_;
  const Occupancy& occupancy_;
  BrickFinder finder_;
  FieldSampler sampler_;
  double longest_m_, end_depth_;
  std::unique_ptr<Packet> packet_;
};

}  // namespace sarnerf

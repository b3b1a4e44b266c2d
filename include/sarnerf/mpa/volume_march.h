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

/// The part of ray (row a, elevation k) inside a box given relative to the aim point.
RangeInterval clip_to_box(const RayGrid& grid, double along_track_m, int k,
                          const Box& box_from_aim);

/// Opens a ray in the batch; segments appended until the next call belong to it.
void begin_ray(SampleBatch& batch, const RayGrid& grid, int row, int k);

/// Calls f(j, near, far) for the parts of [near, far), in bin coordinates, that lie in bins j, in their order; j may be
/// negative.
template <class F>
void for_each_bin_part(double near, double far, F&& f) {
  while (near < far) {
    const double j = std::floor(near), end = std::min(j + 1.0, far);
    f(j, near, end);
    near = end;
  }
}

/// How stretches of a ray are cut.
struct BinCut {
  double longest = std::numeric_limits<double>::infinity();  ///< segment, in bins
  double gap = 0.0;  ///< parts of a bin that are no longer are left out
};

/// Cuts [near, far) of a ray, in bin coordinates, at the borders of the range bins, and the parts evenly until none is longer
/// than allowed; appends a segment for each part, with its centre point, and the bin coordinate of its near end to
/// `near_bin`. Parts nearer than bin 0 get kNoBin, cut at the same pitch; `far` is at most the number of bins, since nothing
/// behind them is seen.
void append_bins(SampleBatch& batch, std::vector<double>& near_bin, const RayGrid& grid, double along_track_m, int k,
                 double near, double far, const BinCut& how);

/// Two-way optical depth behind which nothing is sampled: what lies there has less than 2.1e-9 of its
/// power.
inline constexpr double kEndOfRayDepth = 20.0;

/// The field at the segments of a batch, in the same order.
struct BatchField {
  std::vector<float> extinction_per_m;
  std::vector<float> extinction_back_per_m;  ///< empty unless the field has it
  std::vector<float> source;
  std::vector<double> near_bin;  ///< bin coordinate at which the segment begins; bin j covers [j, j + 1)

  void clear();
};

/// The form in which mpa::integrate takes a field's source.
SourceForm source_form(SourceBasis basis);

/// As mpa::integrate takes it.
FieldSamples<float> samples(const BatchField& field, SourceBasis basis);

/// A ray of a grid of rays: at along-track coordinate a (m) and elevation k, in image row `row` of a batch, where it
/// lies in the field.
struct MarchRay {
  double along_track_m = 0.0;
  int row = 0;
  int k = 0;
  RangeInterval inside{};
  int slice = 0;  ///< of its azimuth row
  int place = 0;  ///< among the rays of its slice
};

/// Cuts rays into segments where a sparse volume is occupied, and samples it there and nowhere else: empty
/// bricks and tiles are stepped over, and a ray ends at the depth given, or a bin and some segments behind the
/// last bin. Some rays go side by side, so that the voxels of one come from memory while others are worked on.
/// Rendering and training use it alike. One per thread; what it is made of must outlive it.
class VolumeMarcher {
 public:
  /// `grid`: its transform relative to the aim point. `longest_m`: of a segment, some voxel at most. Rays end at a
  /// two-way depth of `end_depth`: what lies behind has e^−end_depth of its power.
  VolumeMarcher(const BrickView<const float>& grid, const FieldChannels& channels,
                const Occupancy& occupancy, double longest_m, double end_depth = kEndOfRayDepth);
  ~VolumeMarcher();
  VolumeMarcher(VolumeMarcher&&) noexcept;

  /// Appends rays to the batch in their order, with their segments. `depth`, if it is not empty, becomes the two-way
  /// optical depth of each: at `end_depth` or more, the rest of the ray was left out. Segments do not depend on which
  /// rays are marched together. Cost: some nanoseconds an empty block, brick or tile, 40 to 60 a segment.
  void march(const RayGrid& rays, std::span<const MarchRay> some, SampleBatch& batch, BatchField& field,
             std::span<double> depth = {});

 private:
  struct Ray;
  struct Packet;

  void begin(const RayGrid& rays, const MarchRay& which, Ray& ray) const;
  /// The next stretch of occupied cells, some segments long at most; empty where the ray ends.
  RangeInterval next_run(Ray& ray);
  /// Cuts a run at the borders of bins and wherever a segment would be too long; returns the number of its segments.
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

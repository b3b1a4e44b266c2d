// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <limits>
#include <vector>

#include "sarnerf/field/field_sampler.h"
#include "sarnerf/field/occupancy.h"
#include "sarnerf/mpa/integrate.h"
#include "sarnerf/mpa/segments.h"

namespace sarnerf {

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

/// Cuts rays into segments where a sparse volume is occupied, and samples it there and nowhere else: empty
/// bricks and tiles are stepped over, and a ray ends at kEndOfRayDepth, or a bin and some segments behind the
/// last bin. Rendering and training use it alike. One per thread; what it is made of must outlive it.
class VolumeMarcher {
 public:
  /// `grid`: its transform relative to the aim point. `longest_m`: of a segment, some voxel at most. Rays end at a
  /// two-way depth of `end_depth`: what lies behind has e^−end_depth of its power.
  VolumeMarcher(const BrickView<const float>& grid, const FieldChannels& channels,
                const Occupancy& occupancy, double longest_m, double end_depth = kEndOfRayDepth);

  /// Appends ray (row a, elevation k) to the batch as one of image row `row`, with its segments inside
  /// `interval`. Returns the two-way optical depth of these: at `end_depth` or more, the rest of the
  /// ray was left out. Cost: some nanoseconds an empty block, brick or tile, 40 to 60 a segment.
  double march(const RayGrid& rays, double along_track_m, int row, int k,
               const RangeInterval& interval, SampleBatch& batch, BatchField& field);

 private:
  /// A ray: point at range offset s is start + s · direction.
  struct Line {
    glm::dvec3 start_m, direction;
  };
  /// The borders of range bins, met one after the other.
  struct Cuts {
    double spacing_m, n_bins;
    double bin = 0.0, next_m = -std::numeric_limits<double>::infinity();

    double coordinate(double s_m) const { return s_m / spacing_m + 0.5 * n_bins; }
    double border_m(double j) const { return (j - 0.5 * n_bins) * spacing_m; }
    void begin_at(double s_m);
  };

  double append(const Line& line, const RangeInterval& run, Cuts& cuts, SampleBatch& batch,
                BatchField& field);

  GridTransform transform_;
  FieldChannels channels_;
  const Occupancy& occupancy_;
  BrickFinder finder_;
  FieldSampler sampler_;
  double longest_m_, end_depth_;
};

}  // namespace sarnerf

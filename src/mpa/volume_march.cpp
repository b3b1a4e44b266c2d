// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/mpa/volume_march.h"

#include <algorithm>
#include <cmath>

namespace sarnerf {
namespace {

/// Segments that are sampled before the ray is asked whether it ends.
constexpr double kSegmentsPerRun = 2.0;

/// Longest segments that a ray goes on for behind the bin after the last.
constexpr double kSegmentsBeyond = 8.0;

/// A walk along a straight line through cubes of cells whose size may change from step to step. Which
/// cube comes next is decided by integers, so that rounding can neither skip one nor stand still.
class CellWalk {
 public:
  /// Position in units of cells is start + s · step, with s the range offset (m).
  CellWalk(const glm::dvec3& start, const glm::dvec3& step, double s) : start_(start), step_(step) {
    cell_ = whole_below(start_ + s * step_);
    for (int axis = 0; axis < 3; ++axis) {
      // A ray that runs along the faces of cells never leaves through them.
      if (step_[axis] == 0.0) step_[axis] = 1e-30;
      inverse_[axis] = 1.0 / step_[axis];
      forward_[axis] = step_[axis] > 0.0 ? 1 : 0;
    }
  }

  const glm::ivec3& cell() const { return cell_; }

  /// Leaves the cube of `side` cells (a power of two) that holds the present one; returns s there. Free of
  /// branches where it can be: which side comes next is as good as random.
  double leave(int side) {
    const glm::ivec3 low = cell_ & glm::ivec3(-side);
    const glm::dvec3 border(low + side * forward_);
    const glm::dvec3 exit = (border - start_) * inverse_;
    const bool x_before_y = exit.x < exit.y;
    const double first_two = x_before_y ? exit.x : exit.y;
    const bool z_first = exit.z < first_two;
    const int through = z_first ? 2 : x_before_y ? 0 : 1;
    const double s = z_first ? exit.z : first_two;
    if (side > 1) {
      cell_ = glm::clamp(whole_below(start_ + s * step_), low, low + (side - 1));
    }
    cell_[through] = low[through] + (forward_[through] != 0 ? side : -1);
    return s;
  }

 private:
  /// Floor without a call into the mathematical library, which the baseline instruction set would need.
  static glm::ivec3 whole_below(const glm::dvec3& at) {
    constexpr double kLift = 4294967296.0;  // more than any index
    const auto below = [](double v) {
      return static_cast<int>(static_cast<std::int64_t>(v + kLift) - static_cast<std::int64_t>(kLift));
    };
    return {below(at.x), below(at.y), below(at.z)};
  }

  glm::dvec3 start_, step_, inverse_;
  glm::ivec3 cell_, forward_;
};

}  // namespace

void BatchField::clear() {
  extinction_per_m.clear();
  extinction_back_per_m.clear();
  source.clear();
  near_bin.clear();
}

SourceForm source_form(SourceBasis basis) {
  return basis == SourceBasis::scattering ? SourceForm::scattering : SourceForm::brightness;
}

FieldSamples<float> samples(const BatchField& field, SourceBasis basis) {
  return {field.extinction_per_m, field.extinction_back_per_m, field.source, source_form(basis)};
}

VolumeMarcher::VolumeMarcher(const BrickView<const float>& grid, const FieldChannels& channels,
                             const Occupancy& occupancy, double longest_m, double end_depth)
    : transform_(grid.transform),
      channels_(channels),
      occupancy_(occupancy),
      finder_(occupancy.bricks()),
      sampler_(grid, channels),
      longest_m_(longest_m),
      end_depth_(end_depth) {}

void VolumeMarcher::Cuts::begin_at(double s_m) {
  // Rounding may put a near end that lies on a border to either side of it.
  bin = std::floor(s_m / spacing_m + 0.5 * n_bins);
  next_m = border_m(bin + 1.0);
  if (next_m <= s_m) next_m = border_m(++bin + 1.0);
}

/// Cuts a run at the borders of bins and wherever a segment would be too long, and samples its segments.
/// Returns their two-way optical depth.
double VolumeMarcher::append(const Line& line, const RangeInterval& run, Cuts& cuts,
                             SampleBatch& batch, BatchField& field) {
  const std::size_t first = batch.n_segments();
  if (run.near_m >= cuts.next_m) cuts.begin_at(run.near_m);
  for (double near_m = run.near_m; near_m < run.far_m;) {
    const double end_m = std::min({cuts.next_m, near_m + longest_m_, run.far_m});
    batch.bin.push_back(cuts.bin < 0.0 ? kNoBin : static_cast<std::uint32_t>(cuts.bin));
    batch.length_m.push_back(static_cast<float>(end_m - near_m));
    field.near_bin.push_back(cuts.coordinate(near_m));
    batch.point_m.emplace_back(line.start_m + (0.5 * (near_m + end_m)) * line.direction);
    if (end_m == cuts.next_m) cuts.next_m = cuts.border_m(++cuts.bin + 1.0);
    near_m = end_m;
  }
  const std::size_t n = batch.n_segments() - first;
  batch.ray_begin.back() = static_cast<std::uint32_t>(first + n);
  field.extinction_per_m.resize(first + n);
  field.source.resize(first + n);
  if (channels_.two_extinctions) field.extinction_back_per_m.resize(first + n);
  const auto part = [&](std::vector<float>& all) { return std::span(all).subspan(first, n); };
  sampler_.sample(batch.ray_direction.back(), std::span(batch.point_m).subspan(first, n),
                  {part(field.extinction_per_m),
                   channels_.two_extinctions ? part(field.extinction_back_per_m) : std::span<float>{},
                   part(field.source)});
  double depth = 0.0;
  for (std::size_t s = first; s < first + n; ++s) {
    const float back = channels_.two_extinctions ? field.extinction_back_per_m[s]
                                                 : field.extinction_per_m[s];
    depth += static_cast<double>(batch.length_m[s]) *
             (static_cast<double>(field.extinction_per_m[s]) + static_cast<double>(back));
  }
  return depth;
}

double VolumeMarcher::march(const RayGrid& rays, double along_track_m, int row, int k,
                            const RangeInterval& interval, SampleBatch& batch, BatchField& field) {
  begin_ray(batch, rays, row, k);
  // Nothing behind the last bin is seen, but what a ray emits there says how far its neighbours' power reaches.
  const Acquisition& a = rays.acquisition();
  Cuts cuts{a.range_spacing_m, double(a.n_range)};
  const double end_m = std::min(interval.far_m, cuts.border_m(cuts.n_bins + 1.0) + kSegmentsBeyond * longest_m_);
  if (!(interval.near_m < end_m)) return 0.0;
  const Line line{rays.point_from_aim_m(along_track_m, 0.0, k), rays.direction(k)};
  const double cells_per_m = 1.0 / transform_.voxel_size_m;
  CellWalk walk((line.start_m - transform_.origin_m) * cells_per_m, line.direction * cells_per_m,
                interval.near_m);
  const double run_m = kSegmentsPerRun * longest_m_;
  double depth = 0.0;
  RangeInterval run{interval.near_m, interval.near_m};  // occupied and not yet sampled
  const auto flush = [&] {
    run.far_m = std::min(run.far_m, end_m);
    if (!run.empty()) depth += append(line, run, cuts, batch, field);
  };
  double s = interval.near_m;
  glm::ivec3 brick(0x7fffffff);
  std::uint32_t number = kNoBrick;
  while (s < end_m && depth < end_depth_) {
    if (const glm::ivec3 here = brick_of_voxel(walk.cell()); here != brick) {
      brick = here;
      number = finder_.find(brick);
    }
    if (number != kNoBrick && occupancy_.cell(number, walk.cell())) {
      if (run.far_m < s) run = {s, s};
      s = std::max(s, walk.leave(1));
      run.far_m = s;
      if (run.far_m - run.near_m >= run_m) {
        flush();
        run = {s, s};
      }
      continue;
    }
    if (!run.empty()) {
      flush();
      run = {s, s};
    }
    int side = 1;
    if (number == kNoBrick) {
      side = kBrickSide * (finder_.in_empty_tile(brick) ? kBrickSide : 1);
    } else if (!occupancy_.block(number, walk.cell())) {
      side = 2;
    }
    s = std::max(s, walk.leave(side));
  }
  if (!run.empty() && depth < end_depth_) flush();
  return depth;
}

}  // namespace sarnerf

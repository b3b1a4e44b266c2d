// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/mpa/volume_march.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string>

#include <glm/glm.hpp>

#include "sarnerf/core/error.h"

namespace sarnerf {

namespace {

/// A walk along a straight line through cubes of cells whose size may change from step to step. The next
/// cube is found with integers, so that rounding can neither skip a cube nor stop the walk.
class CellWalk {
 public:
  /// Position in units of cells is start + s · step, with s the range offset (m).
  CellWalk() = default;
  CellWalk(const glm::dvec3& start, const glm::dvec3& step, double s) : start_(start), step_(step) {
    cell_ = whole_below(start_ + s * step_);
    for (int axis = 0; axis < 3; ++axis) {
      // A ray parallel to faces of cells never leaves through them.
      if (step_[axis] == 0.0) step_[axis] = 1e-30;
      inverse_[axis] = 1.0 / step_[axis];
      forward_[axis] = step_[axis] > 0.0 ? 1 : 0;
    }
  }

  const glm::ivec3& cell() const { return cell_; }

  /// Leaves the cube of `side` cells (a power of two) that holds the present one; returns s there. Avoids
  /// branches where possible, because the side through which a ray leaves is unpredictable.
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

/// Length of a run, in longest segments. After each run the ray's optical depth is compared with the end depth.
constexpr double kSegmentsPerRun = 2.0;

/// Rays continue for this many longest segments behind the bin after the last.
constexpr double kSegmentsBeyond = 8.0;

/// Rays that are marched together: enough points at a time to hide the latency of fetching their voxels from memory.
constexpr std::size_t kPacketRays = 16;

/// Steps through the borders of range bins along a ray.
struct Cuts {
  double spacing_m = 1.0, n_bins = 0.0, shift_m = 0.0;
  double bin = 0.0, next_m = -std::numeric_limits<double>::infinity();

  double coordinate(double s_m) const { return (s_m - shift_m) / spacing_m + 0.5 * n_bins; }
  double border_m(double j) const { return (j - 0.5 * n_bins) * spacing_m + shift_m; }
  void begin_at(double s_m) {
    // A near end that lies on a border may be rounded to either side of it.
    bin = std::floor(coordinate(s_m));
    next_m = border_m(bin + 1.0);
    if (next_m <= s_m) next_m = border_m(++bin + 1.0);
  }
};

/// Appends `from` to an array in another order: element s gets index place[s] among the appended ones.
template <class T>
void append_sorted(std::vector<T>& to, const std::vector<T>& from, std::span<const std::uint32_t> place) {
  if (from.empty()) return;
  const std::size_t first = to.size();
  to.resize(first + from.size());
  for (std::size_t s = 0; s < from.size(); ++s) to[first + place[s]] = from[s];
}

}  // namespace

/// A ray that is being marched: the point at range offset s is start + s · direction.
struct VolumeMarcher::Ray {
  glm::dvec3 start_m, direction;
  Cuts cuts;
  CellWalk walk;
  double s_m = 0.0, end_m = 0.0;  ///< range offsets of the walk's position and of its end
  RangeInterval run;              ///< occupied and not yet sampled
  glm::ivec3 brick{0x7fffffff};
  std::uint32_t number = kNoBrick;  ///< of that brick
  double depth = 0.0;
  bool ended = false;
};

/// Rays that are marched together, and their segments in the order in which they are found: those of one ray are in the order
/// of range, those of different rays are mixed.
struct VolumeMarcher::Packet {
  std::array<Ray, kPacketRays> rays;
  SampleBatch batch;  ///< its rays are not used
  BatchField field;
  std::vector<std::uint32_t> ray_of;    ///< of each segment
  std::vector<std::uint32_t> place;     ///< of each segment: its index when they are sorted by ray
  std::vector<std::size_t> under_way;   ///< rays with segments that are not yet sampled
  std::vector<PointsOfRay> waiting;     ///< directions of those rays, and their numbers of such segments
};

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
      end_depth_(end_depth),
      packet_(std::make_unique<Packet>()) {}

VolumeMarcher::~VolumeMarcher() = default;
VolumeMarcher::VolumeMarcher(VolumeMarcher&&) noexcept = default;

void VolumeMarcher::begin(const RayGrid& rays, const MarchRay& which, Ray& ray) const {
  ray = {};
  const Acquisition& a = rays.acquisition();
  ray.cuts.spacing_m = a.range_spacing_m;
  ray.cuts.n_bins = double(a.n_range);
  ray.cuts.shift_m = a.range_shift_m;
  ray.s_m = which.inside.near_m;
  // Segments behind the last bin reach no pixel, but their emission determines the footprints of neighbouring rays.
  ray.end_m = std::min(which.inside.far_m, ray.cuts.border_m(ray.cuts.n_bins + 1.0) + kSegmentsBeyond * longest_m_);
  ray.ended = !(ray.s_m < ray.end_m);
  if (ray.ended) return;
  ray.start_m = rays.point_from_aim_m(which.along_track_m, 0.0, which.k);
  ray.direction = rays.direction(which.k);
  ray.run = {ray.s_m, ray.s_m};
  const double cells_per_m = 1.0 / transform_.voxel_size_m;
  ray.walk = CellWalk((ray.start_m - transform_.origin_m) * cells_per_m, ray.direction * cells_per_m, ray.s_m);
}

RangeInterval VolumeMarcher::next_run(Ray& ray) {
  const double run_m = kSegmentsPerRun * longest_m_;
  const auto take = [&] {
    const RangeInterval run{ray.run.near_m, std::min(ray.run.far_m, ray.end_m)};
    ray.run = {ray.s_m, ray.s_m};
    return run;
  };
  while (ray.s_m < ray.end_m) {
    if (const glm::ivec3 here = brick_of_voxel(ray.walk.cell()); here != ray.brick) {
      ray.brick = here;
      ray.number = finder_.find(here);
    }
    if (ray.number != kNoBrick && occupancy_.cell(ray.number, ray.walk.cell())) {
      if (ray.run.far_m < ray.s_m) ray.run = {ray.s_m, ray.s_m};
      ray.s_m = std::max(ray.s_m, ray.walk.leave(1));
      ray.run.far_m = ray.s_m;
      if (ray.run.far_m - ray.run.near_m >= run_m) {
        if (const RangeInterval run = take(); !run.empty()) return run;
      }
      continue;
    }
    if (!ray.run.empty()) {
      if (const RangeInterval run = take(); !run.empty()) return run;
    }
    int side = 1;
    if (ray.number == kNoBrick) {
      side = kBrickSide * (finder_.in_empty_tile(ray.brick) ? kBrickSide : 1);
    } else if (!occupancy_.block(ray.number, ray.walk.cell())) {
      side = 2;
    }
    ray.s_m = std::max(ray.s_m, ray.walk.leave(side));
  }
  return take();
}

std::size_t VolumeMarcher::cut(Ray& ray, const RangeInterval& run, Packet& packet) const {
  SampleBatch& batch = packet.batch;
  const std::size_t first = batch.n_segments();
  if (run.near_m >= ray.cuts.next_m) ray.cuts.begin_at(run.near_m);
  for (double near_m = run.near_m; near_m < run.far_m;) {
    const double end_m = std::min({ray.cuts.next_m, near_m + longest_m_, run.far_m});
    batch.bin.push_back(ray.cuts.bin < 0.0 ? kNoBin : static_cast<std::uint32_t>(ray.cuts.bin));
    batch.length_m.push_back(static_cast<float>(end_m - near_m));
    packet.field.near_bin.push_back(ray.cuts.coordinate(near_m));
    batch.point_m.emplace_back(ray.start_m + (0.5 * (near_m + end_m)) * ray.direction);
    if (end_m == ray.cuts.next_m) ray.cuts.next_m = ray.cuts.border_m(++ray.cuts.bin + 1.0);
    near_m = end_m;
  }
  return batch.n_segments() - first;
}

void VolumeMarcher::sample(std::size_t first, Packet& packet) {
  BatchField& field = packet.field;
  const std::size_t n = packet.batch.n_segments();
  field.extinction_per_m.resize(n);
  field.source.resize(n);
  if (channels_.two_extinctions) field.extinction_back_per_m.resize(n);
  const auto part = [&](std::vector<float>& all) {
    return all.empty() ? std::span<float>{} : std::span(all).subspan(first);
  };
  sampler_.sample(packet.waiting, std::span(packet.batch.point_m).subspan(first),
                  {part(field.extinction_per_m), part(field.extinction_back_per_m), part(field.source)});
  const std::vector<float>& back = channels_.two_extinctions ? field.extinction_back_per_m : field.extinction_per_m;
  std::size_t s = first;
  for (std::size_t w = 0; w < packet.under_way.size(); ++w) {
    Ray& ray = packet.rays[packet.under_way[w]];
    for (const std::size_t end = s + packet.waiting[w].n_points; s < end; ++s) {
      packet.ray_of.push_back(static_cast<std::uint32_t>(packet.under_way[w]));
      ray.depth += double{packet.batch.length_m[s]} * (double{field.extinction_per_m[s]} + double{back[s]});
    }
    ray.ended = ray.depth >= end_depth_;
  }
}

void VolumeMarcher::march_packet(const RayGrid& rays, std::span<const MarchRay> some, SampleBatch& batch,
                                 BatchField& field) {
  Packet& packet = *packet_;
  packet.batch.clear();
  packet.field.clear();
  packet.ray_of.clear();
  for (std::size_t r = 0; r < some.size(); ++r) begin(rays, some[r], packet.rays[r]);
  do {
    packet.under_way.clear();
    packet.waiting.clear();
    const std::size_t first = packet.batch.n_segments();
    for (std::size_t r = 0; r < some.size(); ++r) {
      Ray& ray = packet.rays[r];
      if (ray.ended) continue;
      const RangeInterval run = next_run(ray);
      ray.ended = run.empty();
      if (ray.ended) continue;
      packet.under_way.push_back(r);
      packet.waiting.push_back({glm::vec3(ray.direction), cut(ray, run, packet)});
    }
    if (!packet.under_way.empty()) sample(first, packet);
  } while (!packet.under_way.empty());

  // Sort the segments by ray, as in the batch.
  std::array<std::uint32_t, kPacketRays + 1> next{};
  for (const std::uint32_t r : packet.ray_of) ++next[r + 1];
  for (std::size_t r = 0; r < some.size(); ++r) {
    next[r + 1] += next[r];
    begin_ray(batch, rays, some[r].row, some[r].k);
    batch.ray_begin.back() += next[r + 1];
  }
  packet.place.clear();
  for (const std::uint32_t r : packet.ray_of) packet.place.push_back(next[r]++);
  append_sorted(batch.bin, packet.batch.bin, packet.place);
  append_sorted(batch.length_m, packet.batch.length_m, packet.place);
  append_sorted(batch.point_m, packet.batch.point_m, packet.place);
  append_sorted(field.extinction_per_m, packet.field.extinction_per_m, packet.place);
  append_sorted(field.extinction_back_per_m, packet.field.extinction_back_per_m, packet.place);
  append_sorted(field.source, packet.field.source, packet.place);
  append_sorted(field.near_bin, packet.field.near_bin, packet.place);
}

void VolumeMarcher::march(const RayGrid& rays, std::span<const MarchRay> some, SampleBatch& batch, BatchField& field,
                          std::span<double> depth) {
  for (std::size_t first = 0; first < some.size(); first += kPacketRays) {
    const std::size_t n = std::min(kPacketRays, some.size() - first);
    march_packet(rays, some.subspan(first, n), batch, field);
    for (std::size_t r = 0; r < n && !depth.empty(); ++r) depth[first + r] = packet_->rays[r].depth;
  }
}

RangeInterval clip_to_box(const RayGrid& grid, double along_track_m, int k,
                          const Box& box_from_aim) {
  if (box_from_aim.empty()) return {};
  const glm::dvec3 start = grid.point_from_aim_m(along_track_m, 0.0, k);
  const glm::dvec3 d = grid.direction(k);
  // Nothing behind the radar is seen.
  RangeInterval inside{-grid.acquisition().slant_range_m, std::numeric_limits<double>::infinity()};
  for (int axis = 0; axis < 3; ++axis) {
    const double to_min = box_from_aim.min[axis] - start[axis];
    const double to_max = box_from_aim.max[axis] - start[axis];
    if (d[axis] == 0.0) {
      // The ray is parallel to these faces. The quotients below would be 0/0 if it lay in one of them.
      if (to_min > 0.0 || to_max < 0.0) return {};
      continue;
    }
    const double at_min = to_min / d[axis];
    const double at_max = to_max / d[axis];
    inside.near_m = std::max(inside.near_m, std::min(at_min, at_max));
    inside.far_m = std::min(inside.far_m, std::max(at_min, at_max));
  }
  return inside.empty() ? RangeInterval{} : inside;
}

void begin_ray(SampleBatch& batch, const RayGrid& grid, int row, int k) {
  batch.ray_row.push_back(static_cast<std::uint32_t>(row));
  batch.ray_elevation.push_back(static_cast<std::uint32_t>(k));
  batch.ray_direction.emplace_back(grid.direction(k));
  batch.ray_begin.push_back(static_cast<std::uint32_t>(batch.n_segments()));
}

void append_bins(SampleBatch& batch, std::vector<double>& near_bin, const RayGrid& grid, double along_track_m, int k,
                 double near, double far, const BinCut& how) {
  const Acquisition& a = grid.acquisition();
  const double spacing_m = a.range_spacing_m;
  // An end that lies on a border may be rounded to either side of it.
  const double gap = std::max(how.gap, 1e-12 * (1.0 + std::max(std::abs(near), std::abs(far))));
  if (!(static_cast<double>(batch.n_segments()) + (far - near) * (1.0 + 1.0 / how.longest) + 2.0 <
        static_cast<double>(std::numeric_limits<std::uint32_t>::max()))) {
    throw UsageError("a batch of rays holds at most 4294967295 segments; give it fewer rays");
  }
  for_each_bin_part(near, far, [&](double bin, double begin, double end) {
    if (!(end - begin > gap)) return;
    const double n_parts = std::max(1.0, std::ceil((end - begin) / how.longest - gap));
    const double length = (end - begin) / n_parts;
    for (double n = 0.0; n < n_parts; n += 1.0) {
      const double at = begin + n * length;
      batch.bin.push_back(bin < 0.0 ? kNoBin : static_cast<std::uint32_t>(bin));
      batch.length_m.push_back(static_cast<float>(length * spacing_m));
      near_bin.push_back(at);
      const double offset_m = (at + 0.5 * length - 0.5 * a.n_range) * spacing_m + a.range_shift_m;
      batch.point_m.emplace_back(grid.point_from_aim_m(along_track_m, offset_m, k));
    }
  });
  batch.ray_begin.back() = static_cast<std::uint32_t>(batch.n_segments());
}

}  // namespace sarnerf

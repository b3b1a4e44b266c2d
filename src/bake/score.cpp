// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/bake/score.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "columns.h"
#include "enclosed.h"
#include "mesh_checks.h"
#include "sarnerf/core/error.h"
#include "sarnerf/core/parallel.h"
#include "sarnerf/scene/surface_distance.h"
#include "sight.h"
#include "surface_samples.h"

namespace sarnerf {
namespace {

constexpr std::size_t kMostSamples = 100'000'000;

/// A surface in coordinates about the centre of the comparison, with what is asked of it.
struct Side {
  SurfaceMesh mesh;
  Box box_m;
  std::size_t n_solid = 0;             ///< the first triangles, which bound closed pieces
  std::vector<SurfaceSample> samples;  ///< not buried
  std::vector<std::uint8_t> seen;      ///< per sample
};

SurfaceMesh about(const SurfaceMesh& mesh, const glm::dvec3& centre_m) {
  SurfaceMesh moved = mesh;
  for (glm::dvec3& v : moved.vertices_m) v -= centre_m;
  return moved;
}

Box around(Box a, const Box& b) {
  a.min = glm::min(a.min, b.min);
  a.max = glm::max(a.max, b.max);
  return a;
}

Box about(const Box& box, const glm::dvec3& centre_m) { return {box.min - centre_m, box.max - centre_m}; }

std::vector<SurfaceSample> open_samples(const Side& side, const Sight& sight, std::size_t n, const Monitor& monitor) {
  const std::vector<SurfaceSample> all = sample_surface(side.mesh, n);
  std::vector<std::uint8_t> buried(all.size());
  parallel_for(all.size(), 1024, [&](std::size_t begin, std::size_t end, int /*worker*/) {
    monitor.check();
    std::vector<Crossing> crossings;
    for (std::size_t m = begin; m < end; ++m) buried[m] = sight.buried(all[m], crossings);
  });
  std::vector<SurfaceSample> open;
  open.reserve(all.size());
  for (std::size_t m = 0; m < all.size(); ++m) {
    if (!buried[m]) open.push_back(all[m]);
  }
  return open;
}

/// From each sample to the nearest point of another surface (m); none when that has no area.
std::vector<double> distances(const Side& from, const Side& to, const Monitor& monitor) {
  if (from.samples.empty() || to.samples.empty()) return {};
  const SurfaceDistance surface(to.mesh.vertices_m, to.mesh.triangles, false);
  std::vector<double> distance_m(from.samples.size());
  std::atomic<std::uint64_t> n_done{0};
  parallel_for(distance_m.size(), 1024, [&](std::size_t begin, std::size_t end, int worker) {
    monitor.check();
    for (std::size_t m = begin; m < end; ++m) distance_m[m] = surface.nearest(from.samples[m].point_m).distance_m;
    const std::uint64_t done = n_done += end - begin;
    if (worker == 0) monitor.report("measuring distances", done, distance_m.size());
  });
  return distance_m;
}

struct Spread {
  double mean_m = kNotMeasured;
  double percentile95_m = kNotMeasured;
  double most_m = kNotMeasured;
};

Spread spread(std::vector<double> distance_m) {
  if (distance_m.empty()) return {};
  double sum_m = 0.0;
  for (const double d : distance_m) sum_m += d;
  const auto place = static_cast<std::ptrdiff_t>(std::ceil(0.95 * static_cast<double>(distance_m.size()))) - 1;
  const auto percentile = distance_m.begin() + place;
  std::nth_element(distance_m.begin(), percentile, distance_m.end());
  return {sum_m / static_cast<double>(distance_m.size()), *percentile,
          *std::max_element(percentile, distance_m.end())};
}

/// The larger one, not measured when either is not.
double larger(double a, double b) { return std::isnan(a) || std::isnan(b) ? kNotMeasured : std::max(a, b); }

SurfaceDistances both_ways(const Spread& from_truth, const Spread& from_extracted) {
  return {from_truth.mean_m, from_extracted.mean_m, 0.5 * (from_truth.mean_m + from_extracted.mean_m),
          larger(from_truth.most_m, from_extracted.most_m),
          larger(from_truth.percentile95_m, from_extracted.percentile95_m)};
}

Spread spread_of_seen(const Side& side, const std::vector<double>& distance_m) {
  std::vector<double> seen_m;
  for (std::size_t m = 0; m < distance_m.size(); ++m) {
    if (side.seen[m] != 0) seen_m.push_back(distance_m[m]);
  }
  return spread(std::move(seen_m));
}

double seen_fraction(const Side& side) {
  if (side.samples.empty()) return 0.0;
  return static_cast<double>(std::count(side.seen.begin(), side.seen.end(), 1)) /
         static_cast<double>(side.samples.size());
}

void score_volumes(const Side& extracted, const Side& truth, const SurfaceMesh& solid, const Box& both,
                   const ScoreOptions& options, SurfaceScore& score) {
  const ColumnLattice lattice = column_lattice(both, options.column_spacing_m);
  const Columns a = columns_of(extracted.mesh, lattice, options.monitor);
  const Columns b = options.truth_volume == TruthVolume::enclosed
                        ? enclosed_columns(truth.mesh, truth.box_m, lattice, options.monitor)
                        : columns_of(solid, lattice, options.monitor);
  const auto ratio = [](double part, double whole) { return whole > 0.0 ? part / whole : 0.0; };
  const auto open = [&](const Columns& c) {
    return ratio(static_cast<double>(c.n_open), static_cast<double>(c.n_met));
  };
  const double common_m3 = common_volume_m3(a, b);
  score.volume_m3 = a.volume_m3();
  score.truth_volume_m3 = b.volume_m3();
  score.iou = ratio(common_m3, score.volume_m3 + score.truth_volume_m3 - common_m3);
  score.precision = ratio(common_m3, score.volume_m3);
  score.recall = ratio(common_m3, score.truth_volume_m3);
  if (score.truth_volume_m3 > 0.0) {
    score.volume_error = (score.volume_m3 - score.truth_volume_m3) / score.truth_volume_m3;
  }
  score.column_spacing_m = both.empty() ? 0.0 : lattice.spacing_m;
  score.open_fraction = open(a);
  score.truth_open_fraction = open(b);
}

void score_boxes(const Box& extracted, const Box& truth, SurfaceScore& score) {
  if (truth.empty()) return;
  const double truth_diagonal_m = glm::length(truth.size());
  const double diagonal_m = extracted.empty() ? 0.0 : glm::length(extracted.size());
  if (truth_diagonal_m > 0.0) score.size_ratio = diagonal_m / truth_diagonal_m;
  if (extracted.empty()) return;
  score.box_min_error_m = extracted.min - truth.min;
  score.box_max_error_m = extracted.max - truth.max;
}

void score_distances(Side& extracted, Side& truth, std::span<const Acquisition> views, const ScoreOptions& options,
                     SurfaceScore& score) {
  for (Side* side : {&extracted, &truth}) {
    const Sight sight(side->mesh, side->box_m, side->n_solid);
    side->samples = open_samples(*side, sight, options.n_samples, options.monitor);
    side->seen = sight.seen(side->samples, views, options.monitor);
  }
  const std::vector<double> from_extracted_m = distances(extracted, truth, options.monitor);
  const std::vector<double> from_truth_m = distances(truth, extracted, options.monitor);
  score.whole = both_ways(spread(from_truth_m), spread(from_extracted_m));
  score.visible = both_ways(spread_of_seen(truth, from_truth_m), spread_of_seen(extracted, from_extracted_m));
  score.visible_fraction = seen_fraction(truth);
  score.extracted_visible_fraction = seen_fraction(extracted);
}

}  // namespace

SurfaceScore score(const SurfaceMesh& extracted, const TruthSurface& truth, std::span<const Acquisition> views,
                   const ScoreOptions& options) {
  if (options.n_samples < 1 || options.n_samples > kMostSamples) {
    throw UsageError("expected 1 to " + std::to_string(kMostSamples) +
                     " points a surface to take distances from, found " + std::to_string(options.n_samples));
  }
  const Box extracted_box = checked_box(extracted, "the extracted surface");
  const Box truth_box = checked_box(truth.all, "the true surface");
  const Box solid_box = checked_box(truth.solid, "the true solid");
  if (truth.n_closed > truth.all.triangles.size()) {
    throw InputError("the true surface has " + std::to_string(truth.all.triangles.size()) +
                     " triangles, of which it says that " + std::to_string(truth.n_closed) + " are of closed pieces");
  }
  for (const Acquisition& view : views) validate(view);

  const Box both = around(around(truth_box, solid_box), extracted_box);
  SurfaceScore result;
  score_boxes(extracted_box, truth_box, result);

  // Everything about one centre, so that digits are not lost to map coordinates.
  const glm::dvec3 centre_m = !truth_box.empty() ? truth_box.centre() : both.empty() ? glm::dvec3(0.0) : both.centre();
  std::vector<Acquisition> moved_views(views.begin(), views.end());
  for (Acquisition& view : moved_views) view.aim_m -= centre_m;
  Side side{about(extracted, centre_m), about(extracted_box, centre_m), extracted.triangles.size(), {}, {}};
  Side truth_side{about(truth.all, centre_m), about(truth_box, centre_m), truth.n_closed, {}, {}};

  score_volumes(side, truth_side, about(truth.solid, centre_m), about(both, centre_m), options, result);
  score_distances(side, truth_side, moved_views, options, result);
  return result;
}

}  // namespace sarnerf

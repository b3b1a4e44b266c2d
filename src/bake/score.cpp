// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/bake/score.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <map>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "columns.h"
#include "sarnerf/bake/surface_mesh.h"
#include "sarnerf/core/error.h"
#include "sarnerf/core/numbers.h"
#include "sarnerf/core/parallel.h"
#include "sarnerf/core/text.h"
#include "sarnerf/geometry/acquisition.h"
#include "sarnerf/scene/surface_distance.h"
#include "sight.h"
#include "winding.h"

namespace sarnerf {

namespace {

/// Six times the signed volume between triangles and an apex.
double six_volumes(const SurfaceMesh& mesh, std::span<const std::uint32_t> triangles, const glm::dvec3& apex_m) {
  double sum = 0.0;
  for (const std::uint32_t t : triangles) {
    const glm::uvec3& c = mesh.triangles[t];
    sum += glm::dot(mesh.vertices_m[c.x] - apex_m,
                    glm::cross(mesh.vertices_m[c.y] - apex_m, mesh.vertices_m[c.z] - apex_m));
  }
  return sum;
}

/// Centre of the border (edges of only one of the triangles), weighted by length; without border, the first corner.
glm::dvec3 centre_of_border(const SurfaceMesh& mesh, std::span<const std::uint32_t> triangles) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> n_of_edge;
  for (const std::uint32_t t : triangles) {
    const glm::uvec3& c = mesh.triangles[t];
    for (int corner = 0; corner < 3; ++corner) ++n_of_edge[std::minmax(c[corner], c[(corner + 1) % 3])];
  }
  const glm::dvec3 origin_m = mesh.vertices_m[mesh.triangles[triangles.front()].x];
  glm::dvec3 sum(0.0);
  double length_m = 0.0;
  for (const auto& [edge, n] : n_of_edge) {
    if (n != 1) continue;
    const glm::dvec3 a = mesh.vertices_m[edge.first] - origin_m, b = mesh.vertices_m[edge.second] - origin_m;
    sum += 0.5 * (a + b) * glm::distance(a, b);
    length_m += glm::distance(a, b);
  }
  return length_m > 0.0 ? origin_m + sum / length_m : origin_m;
}

}  // namespace

TruthSurface truth_of(const Scene& scene) {
  const Mesh& mesh = scene.mesh;
  TruthSurface truth;
  truth.solid.vertices_m = mesh.vertices_m;
  const auto append = [&](SurfaceMesh& to, bool closed) {
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
      if (scene.pieces[mesh.piece[t]].closed == closed) to.triangles.push_back(mesh.triangles[t]);
    }
  };
  append(truth.solid, true);
  truth.all = truth.solid;
  truth.n_closed = truth.solid.triangles.size();
  append(truth.all, false);
  if (truth.n_closed == truth.all.triangles.size()) return truth;

  truth.wound = truth.all;
  std::map<std::uint32_t, std::vector<std::uint32_t>> open_pieces;  // triangles of `all`
  std::uint32_t next = static_cast<std::uint32_t>(truth.n_closed);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    if (!scene.pieces[mesh.piece[t]].closed) open_pieces[mesh.piece[t]].push_back(next++);
  for (const auto& [piece, triangles] : open_pieces) {
    if (six_volumes(truth.all, triangles, centre_of_border(truth.all, triangles)) >= 0.0) continue;
    for (const std::uint32_t t : triangles) std::swap(truth.wound.triangles[t].y, truth.wound.triangles[t].z);
  }
  return truth;
}

namespace {

constexpr std::size_t kMostSamples = 100'000'000;

// Thresholds of truth_volume().
constexpr double kSteady = 0.05;           ///< relative change of the enclosed volume
constexpr double kMissesMost = 2.0;        ///< volume by winding number over the enclosed one
constexpr double kDecided = 0.25;          ///< distance of a winding number from an integer
constexpr double kMostUndecided = 0.05;    ///< fraction of the samples
constexpr int kWindingSamples = 64;        ///< along the longest side of the box

/// A surface in coordinates relative to the centre of the comparison, with its samples.
struct Side {
  SurfaceMesh mesh;
  Box box_m;
  std::size_t n_solid = 0;             ///< the first triangles, which bound closed pieces
  std::vector<SurfaceSample> samples;  ///< not buried
  std::vector<std::uint8_t> seen;      ///< per sample: 1 if a view sees it
};

/// Box of the vertices that triangles use; empty for a mesh without triangles. Throws InputError, naming the
/// mesh, for corners that do not exist and for coordinates that are not finite.
Box checked_box(const SurfaceMesh& mesh, const std::string& name) {
  const std::size_t n_vertices = mesh.vertices_m.size();
  for (std::size_t v = 0; v < n_vertices; ++v) {
    const glm::dvec3& p = mesh.vertices_m[v];
    if (std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z)) continue;
    throw InputError(name + ": vertex " + std::to_string(v) + " is not finite; expected coordinates in metres");
  }
  Box box;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    for (int corner = 0; corner < 3; ++corner) {
      const std::uint32_t v = mesh.triangles[t][corner];
      if (v >= n_vertices) {
        throw InputError(name + ": triangle " + std::to_string(t) + " uses vertex " + std::to_string(v) + " of " +
                         std::to_string(n_vertices) + ", counted from 0");
      }
      box.include(mesh.vertices_m[v]);
    }
  }
  return box;
}

/// Of unit length; 0 for a triangle without area.
glm::dvec3 normal_of(const SurfaceMesh& mesh, std::uint32_t triangle) {
  const glm::uvec3& t = mesh.triangles[triangle];
  const glm::dvec3& a = mesh.vertices_m[t.x];
  const glm::dvec3 normal = glm::cross(mesh.vertices_m[t.y] - a, mesh.vertices_m[t.z] - a);
  const double length = glm::length(normal);
  return length > 0.0 ? normal / length : normal;
}

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

/// From the samples of a surface to the nearest points of another one.
struct Distances {
  std::vector<double> distance_m;
  std::vector<double> angle_rad;  ///< between the normals; those of open pieces have no sign
};

/// Empty when either surface has no samples.
Distances distances(const Side& from, const Side& to, const Monitor& monitor) {
  if (from.samples.empty() || to.samples.empty()) return {};
  const SurfaceDistance surface(to.mesh.vertices_m, to.mesh.triangles, false);
  std::vector<double> distance_m(from.samples.size()), angle_rad(from.samples.size());
  std::atomic<std::uint64_t> n_done{0};
  parallel_for(distance_m.size(), 1024, [&](std::size_t begin, std::size_t end, int worker) {
    monitor.check();
    for (std::size_t m = begin; m < end; ++m) {
      const NearestPoint nearest = surface.nearest(from.samples[m].point_m);
      distance_m[m] = nearest.distance_m;
      double cosine = glm::dot(from.samples[m].normal, normal_of(to.mesh, nearest.triangle));
      if (from.samples[m].triangle >= from.n_solid || nearest.triangle >= to.n_solid) cosine = std::abs(cosine);
      angle_rad[m] = std::acos(std::clamp(cosine, -1.0, 1.0));
    }
    const std::uint64_t done = n_done += end - begin;
    if (worker == 0) monitor.report("measuring distances", done, distance_m.size());
  });
  return {std::move(distance_m), std::move(angle_rad)};
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
  return {sum_m / static_cast<double>(distance_m.size()), quantile_reached(distance_m, 0.95),
          *std::max_element(distance_m.begin(), distance_m.end())};
}

/// The larger one, not measured when either is not.
double larger(double a, double b) { return std::isnan(a) || std::isnan(b) ? kNotMeasured : std::max(a, b); }

SurfaceDistances both_ways(const Spread& from_truth, const Spread& from_extracted) {
  return {from_truth.mean_m, from_extracted.mean_m, 0.5 * (from_truth.mean_m + from_extracted.mean_m),
          larger(from_truth.most_m, from_extracted.most_m),
          larger(from_truth.percentile95_m, from_extracted.percentile95_m)};
}

/// The values of the samples that some view sees.
std::vector<double> of_seen(const Side& side, const std::vector<double>& values) {
  std::vector<double> seen;
  for (std::size_t m = 0; m < values.size(); ++m)
    if (side.seen[m] != 0) seen.push_back(values[m]);
  return seen;
}

double seen_fraction(const Side& side) {
  if (side.samples.empty()) return 0.0;
  return static_cast<double>(std::count(side.seen.begin(), side.seen.end(), 1)) /
         static_cast<double>(side.samples.size());
}

/// The mesh from which winding numbers are computed.
const SurfaceMesh& wound_mesh(const TruthSurface& truth) {
  return truth.wound.triangles.empty() ? truth.all : truth.wound;
}

/// `solid` is the mesh of the truth for options.truth_volume.
Columns columns_of_truth(const Side& truth, const SurfaceMesh& solid, const ColumnLattice& lattice,
                         const ScoreOptions& options) {
  if (options.truth_volume == TruthVolume::enclosed)
    return enclosed_columns(solid, truth.box_m, lattice, options.monitor);
  if (options.truth_volume == TruthVolume::winding_number)
    return wound_columns(solid, truth.box_m, lattice, options.monitor);
  return columns_of(solid, lattice, options.monitor);
}

double area_m2(const SurfaceMesh& mesh) {
  double area = 0.0;
  for (const glm::uvec3& t : mesh.triangles) {
    const glm::dvec3& a = mesh.vertices_m[t.x];
    area += 0.5 * glm::length(glm::cross(mesh.vertices_m[t.y] - a, mesh.vertices_m[t.z] - a));
  }
  return area;
}

/// After score_distances(), which finds what is buried.
void score_volumes(const Side& extracted, const Side& truth, const SurfaceMesh& solid, const Box& both,
                   std::span<const Acquisition> views, const ScoreOptions& options, SurfaceScore& score) {
  const ColumnLattice lattice = column_lattice(both, options.column_spacing_m);
  const Columns a = columns_of(extracted.mesh, lattice, options.monitor);
  const auto ratio = [](double part, double whole) { return whole > 0.0 ? part / whole : 0.0; };
  const auto open = [&](const Columns& c) {
    return ratio(static_cast<double>(c.n_open), static_cast<double>(c.n_met));
  };
  score.column_spacing_m = both.empty() ? 0.0 : lattice.spacing_m;
  score.volume_m3 = a.volume_m3();
  score.open_fraction = open(a);
  if (options.truth_volume == TruthVolume::none) {
    score.iou = score.precision = score.recall = score.truth_volume_m3 = kNotMeasured;
    return;
  }
  const Columns b = columns_of_truth(truth, solid, lattice, options);
  const double common_m3 = common_volume_m3(a, b);
  score.truth_volume_m3 = b.volume_m3();
  score.iou = ratio(common_m3, score.volume_m3 + score.truth_volume_m3 - common_m3);
  score.precision = ratio(common_m3, score.volume_m3);
  score.recall = ratio(common_m3, score.truth_volume_m3);
  if (score.truth_volume_m3 > 0.0) {
    score.volume_error = (score.volume_m3 - score.truth_volume_m3) / score.truth_volume_m3;
    const double open_part = static_cast<double>(truth.samples.size()) / static_cast<double>(options.n_samples);
    score.symmetric_difference_m =
        ratio(score.volume_m3 + score.truth_volume_m3 - 2.0 * common_m3, open_part * area_m2(truth.mesh));
  }
  if (score.truth_volume_m3 > 0.0 && !views.empty()) {
    const Sight sight(truth.mesh, truth.box_m, truth.n_solid);
    const HiddenSpace hidden = hidden_space(a, b, truth.box_m, sight, views, options.monitor);
    score.observable_iou =
        ratio(common_m3, score.volume_m3 + score.truth_volume_m3 - common_m3 - std::min(hidden.extracted_m3, score.volume_m3 - common_m3));
    score.hull_iou = ratio(score.truth_volume_m3, score.truth_volume_m3 + hidden.whole_m3);
  }
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

/// Rays that layover costs at most, and the samples that pixels need.
constexpr std::size_t kMostLayoverRays = 4'000'000, kLeastLayoverSamples = 10'000;

/// The visible distances from the truth, apart for what lies in layover in every view: on every k-th sample.
void score_layover(const Side& truth, const Sight& sight, std::span<const double> distance_m, std::span<const Acquisition> views,
                   const Monitor& monitor, SurfaceScore& score) {
  if (views.empty() || distance_m.empty()) return;
  const std::size_t n_wanted = std::max(kLeastLayoverSamples, kMostLayoverRays / views.size());
  const std::size_t stride = std::max<std::size_t>(1, truth.samples.size() / n_wanted);
  std::vector<SurfaceSample> some;
  std::vector<double> of_some;
  for (std::size_t m = 0; m < truth.samples.size(); m += stride) {
    if (truth.seen[m] == 0) continue;
    some.push_back(truth.samples[m]);
    of_some.push_back(distance_m[m]);
  }
  if (some.empty()) return;
  const std::vector<std::uint8_t> alone = sight.seen_alone(some, views, monitor);
  std::array<double, 2> sum_m{}, n{};
  for (std::size_t m = 0; m < some.size(); ++m) {
    sum_m[alone[m]] += of_some[m];
    n[alone[m]] += 1.0;
  }
  if (n[1] > 0.0) score.completeness_alone_m = sum_m[1] / n[1];
  if (n[0] > 0.0) score.completeness_laid_over_m = sum_m[0] / n[0];
  score.laid_over_fraction = n[0] / (n[0] + n[1]);
}

void score_distances(Side& extracted, Side& truth, std::span<const Acquisition> views, const ScoreOptions& options,
                     SurfaceScore& score) {
  const Sight of_extracted(extracted.mesh, extracted.box_m, extracted.n_solid), of_truth(truth.mesh, truth.box_m, truth.n_solid);
  for (const auto& [side, sight] : {std::pair(&extracted, &of_extracted), std::pair(&truth, &of_truth)}) {
    side->samples = open_samples(*side, *sight, options.n_samples, options.monitor);
    side->seen = sight->seen(side->samples, views, options.monitor);
  }
  const Distances from_extracted = distances(extracted, truth, options.monitor);
  const Distances from_truth = distances(truth, extracted, options.monitor);
  score.whole = both_ways(spread(from_truth.distance_m), spread(from_extracted.distance_m));
  score.visible = both_ways(spread(of_seen(truth, from_truth.distance_m)), spread(of_seen(extracted, from_extracted.distance_m)));
  std::vector<double> angle_rad = of_seen(truth, from_truth.angle_rad);
  if (!angle_rad.empty()) score.normal_error_rad = median(std::move(angle_rad));
  score.visible_fraction = seen_fraction(truth);
  score.extracted_visible_fraction = seen_fraction(extracted);
  score_layover(truth, of_truth, from_truth.distance_m, views, options.monitor, score);
}

/// Statistics of winding numbers in a truth's box.
struct WindingCensus {
  double undecided = 0.0;  ///< fraction of the samples farther than kDecided from an integer
  double inside = 0.0;     ///< fraction of the samples above 1/2
};

WindingCensus winding_census(const SurfaceMesh& mesh, const Box& box_m, const Monitor& monitor) {
  const std::vector<WindingSample> samples = winding_samples(mesh, box_m, kWindingSamples, monitor);
  std::size_t n_undecided = 0, n_inside = 0;
  for (const WindingSample& sample : samples) {
    n_undecided += std::abs(sample.winding - std::round(sample.winding)) > kDecided ? 1 : 0;
    n_inside += sample.winding > 0.5 ? 1 : 0;
  }
  const auto n = static_cast<double>(std::max<std::size_t>(1, samples.size()));
  return {static_cast<double>(n_undecided) / n, static_cast<double>(n_inside) / n};
}

}  // namespace

std::string_view name(TruthVolume volume) {
  switch (volume) {
    case TruthVolume::closed_pieces: return "closed pieces";
    case TruthVolume::enclosed: return "enclosed";
    case TruthVolume::winding_number: return "winding number";
    case TruthVolume::none: return "none";
  }
  return "none";
}

TruthVolumeChoice truth_volume(const TruthSurface& truth, const ScoreOptions& options) {
  if (truth.n_closed == truth.all.triangles.size()) return {};
  const Monitor& monitor = options.monitor;
  const Box box_m = checked_box(truth.all, "the true surface");
  const glm::dvec3 centre_m = box_m.centre();
  const Box own_box_m = about(box_m, centre_m);
  const SurfaceMesh all = about(truth.all, centre_m);
  const ColumnLattice fine = column_lattice(own_box_m, options.column_spacing_m);
  const ColumnLattice coarse = column_lattice(own_box_m, 2.0 * fine.spacing_m);
  const double enclosed_m3 = enclosed_columns(all, own_box_m, fine, monitor).volume_m3();
  const double coarsely_m3 = enclosed_columns(all, own_box_m, coarse, monitor).volume_m3();
  const bool steady = enclosed_m3 > 0.0 && std::abs(coarsely_m3 - enclosed_m3) <= kSteady * enclosed_m3;

  const WindingCensus census = winding_census(about(wound_mesh(truth), centre_m), own_box_m, monitor);
  const bool decided = census.undecided <= kMostUndecided && census.inside > 0.0;
  const glm::dvec3 size_m = own_box_m.size();
  const double wound_m3 = census.inside * size_m.x * size_m.y * size_m.z;
  if (steady && !(decided && wound_m3 > kMissesMost * enclosed_m3))
    return {TruthVolume::enclosed, "some of it are thin shells; its volume is what it encloses, standing on the ground"};
  if (decided)
    return {TruthVolume::winding_number,
            "it has holes that let air in; its volume is where its winding number exceeds 1/2"};
  if (census.undecided > kMostUndecided)
    return {TruthVolume::none,
            format("%.1f %% of its box have a winding number farther than 0.25 from a whole one, so that its holes leave "
                   "open what is inside",
                   100.0 * census.undecided)};
  return {TruthVolume::none, "it encloses nothing, and its winding number exceeds 1/2 nowhere"};
}

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

  // All coordinates are relative to one centre, so that map coordinates lose no digits.
  const glm::dvec3 centre_m = !truth_box.empty() ? truth_box.centre() : both.empty() ? glm::dvec3(0.0) : both.centre();
  std::vector<Acquisition> moved_views(views.begin(), views.end());
  for (Acquisition& view : moved_views) view.aim_m -= centre_m;
  Side side{about(extracted, centre_m), about(extracted_box, centre_m), extracted.triangles.size(), {}, {}};
  Side truth_side{about(truth.all, centre_m), about(truth_box, centre_m), truth.n_closed, {}, {}};

  const SurfaceMesh& solid = options.truth_volume == TruthVolume::closed_pieces    ? truth.solid
                             : options.truth_volume == TruthVolume::winding_number ? wound_mesh(truth)
                                                                                   : truth.all;
  score_distances(side, truth_side, moved_views, options, result);
  score_volumes(side, truth_side, about(solid, centre_m), about(both, centre_m), moved_views, options, result);
  return result;
}

}  // namespace sarnerf

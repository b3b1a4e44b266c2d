// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/bake/extract.h"

#include <algorithm>
#include <cmath>

#include "contour.h"
#include "level_surface.h"
#include "learned_volume.h"
#include "sarnerf/core/error.h"
#include "sarnerf/core/text.h"
#include "sarnerf/core/parallel.h"
#include "sarnerf/nerf/grid_field.h"
#include "sarnerf/nerf/mlp_field.h"
#include "sarnerf/nerf/model_file.h"
#include "sarnerf/nerf/row_renderer.h"
#include "sarnerf/nerf/surface_field.h"

namespace sarnerf {
namespace {

VoxelLattice lattice_over(const Box& box_m, double voxel_size_m, const glm::dvec3& origin_m) {
  VoxelLattice lattice;
  lattice.transform = {origin_m, voxel_size_m};
  lattice.first = glm::ivec3(glm::floor(lattice.transform.index_from_world(box_m.min)));
  lattice.last = glm::ivec3(glm::ceil(lattice.transform.index_from_world(box_m.max)));
  return lattice;
}

/// Relative to the aim point.
struct Cube {
  Box box_m;
  double part_outside = 0.0;
};

Cube cube_of(const ExtractOptions& options, const Box& matter_m, const glm::dvec3& aim_m) {
  // Occupied voxels taller than the cube are fog that no view has seen to be empty, above objects at their bottom. The cube
  // extends below the objects, so that its own bottom is not taken for theirs.
  const bool fits = matter_m.size().y <= options.extent_m;
  glm::dvec3 centre_m(0.0, fits ? matter_m.centre().y : matter_m.min.y + 0.25 * options.extent_m, 0.0);
  if (options.centre_m) centre_m = *options.centre_m - aim_m;
  Cube cube;
  cube.box_m = {centre_m - 0.5 * options.extent_m, centre_m + 0.5 * options.extent_m};
  const glm::dvec3 common = glm::min(cube.box_m.max, matter_m.max) - glm::max(cube.box_m.min, matter_m.min);
  if (common.x <= 0.0 || common.y <= 0.0 || common.z <= 0.0) {
    const glm::dvec3 c = matter_m.centre() + aim_m, size = matter_m.size();
    throw UsageError(
        format("--extent: a cube of %.6g m around %.6g,%.6g,%.6g does not meet the occupied part of the field, which is "
               "%.3g x %.3g x %.3g m around %.6g,%.6g,%.6g; leave out --centre, or move it there",
               options.extent_m, centre_m.x + aim_m.x, centre_m.y + aim_m.y, centre_m.z + aim_m.z, size.x, size.y, size.z,
               c.x, c.y, c.z));
  }
  const glm::dvec3 whole = matter_m.size();
  cube.part_outside = 1.0 - common.x * common.y * common.z / (whole.x * whole.y * whole.z);
  return cube;
}

/// Common input of the plan and the extraction; frames relative to the aim point.
struct Setup {
  const GridField* grid = nullptr;  ///< one of these three is set
  const MlpField* mlp = nullptr;
  const SurfaceField* surface = nullptr;
  Box matter_m;
  std::vector<Acquisition> views;  ///< of the training
  VoxelLattice lattice;
  double part_outside = 0.0;

  Box box_m(const glm::dvec3& aim_m) const {
    return {aim_m + lattice.transform.world_from_index(glm::dvec3(lattice.first) - 0.5),
            aim_m + lattice.transform.world_from_index(glm::dvec3(lattice.last) + 0.5)};
  }
};

void require_voxels_within(const Box& matter_m, const ExtractOptions& options) {
  const glm::dvec3 size_m = matter_m.size();
  const double longest_m = std::max({size_m.x, size_m.y, size_m.z}), voxel_m = options.extent_m / options.resolution;
  if (voxel_m <= 0.5 * longest_m) return;
  throw UsageError(format("--extent: %.6g m in %d voxels makes them %.3g m wide, too wide for the occupied part of the field, which is "
                          "%.3g x %.3g x %.3g m; an extent of %.2g m would hold it",
                          options.extent_m, options.resolution, voxel_m, size_m.x, size_m.y, size_m.z, 1.1 * longest_m));
}

/// A ground above the field leaves nothing of a body; one far below extends the body to the limits of the swaths.
void require_ground_at(const Model& model, const Box& matter_m, const ExtractOptions& options) {
  if (!options.ground_height_m) return;
  const double ground_m = *options.ground_height_m;
  const double top_m = model.info.aim_m.y + matter_m.max.y;
  const double bottom_m = std::min(model.info.scene_box_m.min.y, model.info.aim_m.y + matter_m.min.y);
  if (ground_m >= top_m)
    throw UsageError(format("--ground-height: %.6g m lies above all that was learned, which spans heights of %.4g to %.4g m, "
                            "so that nothing is left; leave it out, and the body ends at the learned ground or where views show none of it",
                            ground_m, bottom_m, top_m));
  if (ground_m < bottom_m - (top_m - bottom_m))
    throw UsageError(format("--ground-height: %.6g m lies farther below the scene, which spans heights of %.4g to %.4g m, than "
                            "that is high; leave it out, and the body ends at the learned ground or where views show none of it",
                            ground_m, bottom_m, top_m));
}

/// The message quotes the box of the scene.
[[noreturn]] void throw_without_matter(const Model& model) {
  const glm::dvec3 low = model.info.scene_box_m.min, high = model.info.scene_box_m.max;
  throw UsageError(format("the model holds no matter at all: its images show nothing within the scene's box (%.4g..%.4g, "
                          "%.4g..%.4g, %.4g..%.4g m); check box and aim point of the dataset, or train longer",
                          low.x, high.x, low.y, high.y, low.z, high.z));
}

/// The distance alone bounds the body of a surface; fog has a threshold, and no surface that could be closed.
void require_options_of(bool surface, const ExtractOptions& options) {
  if (surface && options.threshold_per_m)
    throw UsageError("--threshold: the field of this model is a surface, which bounds the body without it; leave it out");
  if (!surface && options.unseen)
    throw UsageError("--unseen: the field of this model is fog, whose body is where --threshold is reached; leave it out");
}

Setup set_up(const Model& model, const ExtractOptions& options) {
  Setup s;
  s.matter_m = model.field->occupied_box_m();
  if (s.matter_m.empty()) throw_without_matter(model);
  s.grid = dynamic_cast<const GridField*>(model.field.get());
  s.mlp = dynamic_cast<const MlpField*>(model.field.get());
  s.surface = dynamic_cast<const SurfaceField*>(model.field.get());
  require_options_of(s.surface != nullptr, options);
  require_ground_at(model, s.matter_m, options);
  for (const DatasetView& view : model.info.training_views) s.views.push_back(acquisition_of(view, glm::dvec3(0.0)));
  const double field_voxel_m = model.field->voxel_size_m();
  if (options.resolution == 0) {
    const double voxel_m = s.mlp != nullptr ? field_voxel_m / 3.0 : field_voxel_m;
    const glm::dvec3 origin_m = s.grid != nullptr      ? s.grid->transform().origin_m
                                : s.surface != nullptr ? s.surface->transform().origin_m
                                                       : glm::dvec3(0.5 * voxel_m);
    s.lattice = lattice_over(s.matter_m, voxel_m, origin_m);
  } else {
    require_voxels_within(s.matter_m, options);
    const Cube cube = cube_of(options, s.matter_m, model.info.aim_m);
    const double voxel_m = options.extent_m / options.resolution;
    s.part_outside = cube.part_outside;
    s.lattice.transform = {cube.box_m.min + 0.5 * voxel_m, voxel_m};
    s.lattice.last = glm::ivec3(options.resolution - 1);
  }
  return s;
}

std::vector<float> extinctions(const LearnedVolume& volume) {
  const auto values = volume.grid.view().values;
  std::vector<float> some;
  for (std::size_t v = 0; v < values.size(); v += static_cast<std::size_t>(volume.channels.count()))
    if (values[v] > 0.0f) some.push_back(values[v]);
  return some;
}

}  // namespace

double otsu_threshold(std::vector<float> extinction_per_m) {
  if (extinction_per_m.empty()) return 0.0;
  constexpr std::size_t kClasses = 256;
  const auto [least, most] = std::minmax_element(extinction_per_m.begin(), extinction_per_m.end());
  const double low = std::log(double{*least}), width = (std::log(double{*most}) - low) / kClasses;
  if (!(width > 0.0)) return double{*least};
  std::vector<double> count(kClasses, 0.0);
  for (const float e : extinction_per_m)
    count[std::min(kClasses - 1, static_cast<std::size_t>((std::log(double{e}) - low) / width))] += 1.0;
  double n = 0.0, sum = 0.0;
  for (std::size_t c = 0; c < kClasses; ++c) n += count[c], sum += count[c] * static_cast<double>(c);
  double n_low = 0.0, sum_low = 0.0, best = -1.0;
  std::size_t border = 0;
  for (std::size_t c = 0; c + 1 < kClasses; ++c) {
    n_low += count[c];
    sum_low += count[c] * static_cast<double>(c);
    if (n_low == 0.0 || n_low == n) continue;
    const double difference = sum_low / n_low - (sum - sum_low) / (n - n_low);
    const double between = n_low * (n - n_low) * difference * difference;
    if (between > best) best = between, border = c + 1;
  }
  return std::exp(low + width * static_cast<double>(border));
}

ExtractionPlan plan_extraction(const Model& model, const ExtractOptions& options) {
  const Setup s = set_up(model, options);
  ExtractionPlan plan;
  plan.voxel_size_m = s.lattice.transform.voxel_size_m;
  plan.box_m = s.box_m(model.info.aim_m);
  plan.part_outside = s.part_outside;
  if (s.surface != nullptr) {
    const std::size_t n_bricks = bricks_of_surface(*s.surface, s.lattice).size();
    plan.n_voxels = n_bricks * kBrickVoxels;
    plan.voxel_bytes = surface_grid_bytes(n_bricks);
    plan.grids = surface_grid_names();
    return plan;
  }
  FieldChannels channels = sampled_channels();
  if (s.grid != nullptr) {
    const LearnedVolume native = native_volume(*s.grid);
    channels = native.channels;
    const std::size_t n_native = native.grid.topology().n_bricks();
    const std::size_t n_bricks =
        options.resolution == 0 ? n_native
                                : bricks_with_matter(native.occupancy(), native.grid.transform(), s.lattice).size();
    plan.n_voxels = n_bricks * kBrickVoxels;
    plan.voxel_bytes = volume_bytes(n_native, channels) + 2 * volume_bytes(n_bricks, channels);
  } else {
    const OccupancyGrid& cache = s.mlp->cache();
    const std::size_t n_bricks = bricks_with_matter(cache.occupancy(), cache.transform(), s.lattice).size();
    plan.n_voxels = n_bricks * kBrickVoxels;
    plan.voxel_bytes = 2 * volume_bytes(n_bricks, channels);
  }
  plan.grids = grid_names(channels);
  return plan;
}

namespace {

/// Height relative to the aim point at which a body ends below, if it is known.
std::optional<double> floor_of(const ExtractOptions& options, const LevelGround* ground, const glm::dvec3& aim_m) {
  if (options.ground_height_m) return *options.ground_height_m - aim_m.y;
  if (ground != nullptr) return ground->height_m;
  return std::nullopt;
}

Box within(const Box& a, const Box& b) { return {glm::max(a.min, b.min), glm::min(a.max, b.max)}; }

Extraction extract_surface(const Model& model, const Setup& setup, const ExtractOptions& options) {
  Stopwatch clock;
  Extraction result;
  result.is_surface = true;
  const glm::dvec3 aim_m = model.info.aim_m;
  result.part_outside = setup.part_outside;
  result.voxel_size_m = setup.lattice.transform.voxel_size_m;
  result.box_m = setup.box_m(aim_m);
  const std::optional<double> floor_m = floor_of(options, setup.surface->ground.get(), aim_m);
  if (floor_m) result.floor_m = aim_m.y + *floor_m;
  GridTransform in_world = setup.lattice.transform;
  in_world.origin_m += aim_m;
  openvdb::FloatGrid::Ptr distance = surface_distance(*setup.surface, setup.lattice, in_world, floor_m, options.max_memory_bytes,
                                                      options.monitor);
  result.seconds.field = clock.lap();

  std::vector<Acquisition> views = setup.views;
  for (Acquisition& view : views) view.aim_m = aim_m;
  Contour surface = contour(*distance, views, options.monitor);
  if (options.unseen.value_or(floor_m ? Unseen::hull : Unseen::membrane) == Unseen::membrane) {
    distance = close_unseen(*distance, surface.mesh);
    Contour closed = contour(*distance, views, options.monitor);
    closed.n_unseen += surface.n_unseen;
    closed.n_components += surface.n_unseen;
    surface = std::move(closed);
  }
  result.seconds.body = clock.lap();
  result.volume = surface_grids(*setup.surface, setup.lattice, distance, surface.mesh);
  result.mesh = std::move(surface.mesh);
  result.largest_component_m = largest_component_m(result.mesh);
  result.n_components = surface.n_components;
  result.n_unseen_components = surface.n_unseen;
  const std::vector<std::uint8_t>& unseen = result.mesh.unseen;
  const auto n_unseen = static_cast<double>(std::count(unseen.begin(), unseen.end(), std::uint8_t{1}));
  if (!unseen.empty()) result.unseen_part = n_unseen / static_cast<double>(unseen.size());
  result.bottom_m = aim_m.y + setup.matter_m.min.y;
  if (!result.mesh.vertices_m.empty()) {
    const auto lower = [](const glm::dvec3& a, const glm::dvec3& b) { return a.y < b.y; };
    result.bottom_m = std::min_element(result.mesh.vertices_m.begin(), result.mesh.vertices_m.end(), lower)->y;
  }
  const Box matter_m{setup.matter_m.min + aim_m, setup.matter_m.max + aim_m};
  result.volume.scene_box_m = within(matter_m, result.box_m);
  describe(result.volume, model, options, result);
  result.seconds.mesh = clock.lap();
  return result;
}

}  // namespace

Extraction extract(const Model& model, const ExtractOptions& options) {
  const Setup setup = set_up(model, options);
  if (setup.surface != nullptr) return extract_surface(model, setup, options);
  Stopwatch clock;
  Extraction result;
  const glm::dvec3 aim_m = model.info.aim_m;
  const Box& matter_m = setup.matter_m;
  const GridField* const grid = setup.grid;
  const VoxelLattice& lattice = setup.lattice;
  result.part_outside = setup.part_outside;
  result.voxel_size_m = lattice.transform.voxel_size_m;
  result.box_m = setup.box_m(aim_m);

  LearnedVolume learned = grid != nullptr
                              ? native_volume(*grid)
                              : sampled(*setup.mlp, lattice, setup.views, options.max_memory_bytes, options.monitor);
  result.harmonics_residual = learned.harmonics_residual;
  const std::vector<float> all = extinctions(learned);
  if (all.empty()) throw_without_matter(model);
  const double least = double{*std::min_element(all.begin(), all.end())};
  const double most = double{*std::max_element(all.begin(), all.end())};
  result.threshold_per_m = options.threshold_per_m.value_or(otsu_threshold(all));
  if (result.threshold_per_m > most)
    throw UsageError(format("--threshold: no voxel has so much extinction; those of this field have %.3g to %.3g per "
                            "metre, so that anything below the larger one leaves some", least, most));
  if (grid != nullptr && options.resolution != 0)
    learned = resampled(learned, lattice, options.max_memory_bytes, options.monitor);
  result.seconds.field = clock.lap();

  const std::optional<double> floor_m = floor_of(options, grid != nullptr ? grid->ground.get() : setup.mlp->ground.get(), aim_m);
  if (floor_m) result.floor_m = aim_m.y + *floor_m;
  result.bottom_m = floor_m.value_or(matter_m.min.y) + aim_m.y;
  const openvdb::FloatGrid::Ptr occupancy = occupancy_above(learned, result.threshold_per_m, floor_m);
  result.seconds.body = clock.lap();

  GridTransform in_world = lattice.transform;
  in_world.origin_m += aim_m;
  result.volume = volume_grids(learned, in_world, occupancy, options.resolution != 0);
  result.mesh = level_surface(*occupancy, 0.5);
  result.volume.scene_box_m = within({matter_m.min + aim_m, matter_m.max + aim_m}, result.box_m);
  describe(result.volume, model, options, result);
  result.seconds.mesh = clock.lap();
  return result;
}

}  // namespace sarnerf

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <mutex>
#include <span>
#include <vector>

#include <glm/glm.hpp>

#include "appearance.h"
#include "layers/layer_row.h"
#include "plan.h"
#include "sarnerf/mpa/integrate.h"
#include "sarnerf/scene/scene.h"
#include "sarnerf/trace/ray_tracer.h"
#include "surface/row_slices.h"
#include "surface/slice.h"

namespace sarnerf {

/// Some triangles of a mesh in single precision relative to a local origin, as input of Embree.
struct TriangleSubset {
  std::vector<glm::vec3> vertices_m;  ///< with one padding element at the end, see RayTracer
  std::vector<glm::uvec3> triangles;
};

/// Copies the chosen triangles and the vertices that they use. The origin is subtracted in double precision,
/// so that scenes in UTM coordinates lose no accuracy.
TriangleSubset take_triangles(const Mesh& mesh, std::span<const std::uint32_t> chosen,
                              const glm::dvec3& origin_m);

/// The vertices without the padding element.
inline std::span<const glm::vec3> vertices(const std::vector<glm::vec3>& padded) {
  return std::span(padded).first(padded.size() - 1);
}

/// A face at which a medium begins or ends along a ray.
struct MediaBoundary {
  double bin;            ///< x, range in bin coordinates
  double bin_per_ray;    ///< change of x over one step of k
  double bin_per_slice;  ///< change of x over the slice's width
  double sign;           ///< +1 entering, −1 leaving
  std::uint32_t piece;
  std::uint16_t medium;
};

/// Segments of the rays of one slice, as arrays for mpa::integrate. Scratch of one worker.
struct MediaScratch {
  std::vector<Crossing> crossings;
  std::vector<MediaBoundary> boundaries, moved;
  std::vector<std::uint32_t> ray_begin, ray_row, bin;
  std::vector<float> length_m, extinction, extinction_back, scattering;
  std::vector<std::uint32_t> ray_k;    ///< k of each ray
  std::vector<double> contributions;   ///< of each segment; for layers only
  void clear();
};

/// A coarser sampling that a slice belongs to, and its row of bins.
struct MediaSubset {
  int k_step = 1;
  SliceGroup group;
  MediaScratch* scratch = nullptr;
  std::span<double> bins;
};

/// Homogeneous translucent solids of a scene. A medium is constant between entry and exit, so that no ray
/// marching is needed: each ray is cut at the faces it crosses and at the borders of bins, and each piece is
/// integrated in closed form. Where solids overlap, their extinctions and scatterings add.
class Media {
 public:
  /// Takes the closed translucent pieces of the scene; `scene_origin_m` as in ViewRays.
  Media(const Scene& scene, const glm::dvec3& scene_origin_m);

  bool empty() const { return triangles_.empty(); }
  const Box& box_m() const { return box_; }  ///< world coordinates
  std::uint64_t memory_bytes() const { return tracer_ ? tracer_->memory_bytes() : 0; }

  /// Attenuates the γ of the slice's samples by the media in front of them, and deposits the power that the media
  /// scatter, in the units of deposit_slice(). Only rays k in [first, end) are processed: those
  /// that may meet the media's box. The slice must be complete; `weight` is its weight. `layers`, unless null, gets
  /// the same deposits, and marks where media hide the reference plane: where less than half of the power comes back.
  void apply(const ViewRays& rays, Integrator integrator, int first, int end, double weight, Slice& slice,
             MediaScratch& scratch, std::span<double> bins, LayerRow* layers = nullptr,
             std::span<const MediaSubset> subsets = {}) const;

 private:
  /// Two-way optical depth from the radar to a bin coordinate.
  double depth_before(double bin, double spacing_m, std::span<const MediaBoundary> boundaries) const;

  /// The cell that a ray represents: its weight, its numbers of rays and of slices, and the shift (in slices) from the
  /// ray's slice to the cell's centre.
  struct Cell {
    double weight = 1.0, rays = 1.0, slices = 1.0, shift = 0.0;
  };
  /// Appends the segments of a ray, or of several sub-rays spread over its cell where faces are steep.
  void append_ray(const Cell& cell, double spacing_m, double end_of_ray, double n_bins, int k,
                  std::span<const MediaBoundary> boundaries, MediaScratch& scratch) const;

  /// Writes the faces that ray k of the slice crosses to scratch.boundaries, in order of range.
  void find_boundaries(const ViewRays& rays, const Slice& slice, int k, MediaScratch& scratch) const;

  std::vector<glm::vec3> vertices_m_;
  std::vector<glm::uvec3> triangles_;
  std::vector<std::uint32_t> piece_;     ///< per triangle
  std::vector<std::uint16_t> medium_;    ///< per triangle
  std::vector<Material> media_;
  bool two_way_equal_ = true;            ///< κ⁺ = κ⁻ everywhere: the second array stays empty
  Box box_;
  std::unique_ptr<RayTracer> tracer_;
};

/// A scene prepared for ray casting. The surface engine builds it once for all views.
class SurfaceScene {
 public:
  /// `scene` must outlive it.
  explicit SurfaceScene(const Scene& scene);

  /// Components of the triangles in `opaque`; computed on the first call, for layers.
  std::span<const Component> components() const;
  std::uint64_t memory_bytes() const;

  const Scene& scene;
  glm::dvec3 origin_m;  ///< of the scene frame, in which Embree works
  AppearanceTable appearances;
  TriangleSubset opaque;
  std::unique_ptr<RayTracer> tracer;
  Media media;
  std::vector<std::string> warnings;

 private:
  mutable std::once_flag components_found_;
  mutable std::vector<Component> components_;
};

}  // namespace sarnerf

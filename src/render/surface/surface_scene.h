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

/// Some triangles of a mesh in single precision around an origin of their own: what Embree takes.
struct TriangleSubset {
  std::vector<glm::vec3> vertices_m;  ///< one more than are used, see RayTracer
  std::vector<glm::uvec3> triangles;
};

/// Only vertices that the chosen triangles use are kept. Differences to the origin are formed in
/// double precision, so that scenes in UTM coordinates lose nothing.
TriangleSubset take_triangles(const Mesh& mesh, std::span<const std::uint32_t> chosen,
                              const glm::dvec3& origin_m);

/// The vertices without the padding element.
inline std::span<const glm::vec3> vertices(const std::vector<glm::vec3>& padded) {
  return std::span(padded).first(padded.size() - 1);
}

/// A face at which a medium begins or ends along a ray.
struct MediaBoundary {
  double bin;            ///< x, range in bin coordinates
  double bin_per_ray;    ///< how it moves over one step of k
  double bin_per_slice;  ///< and over the slice's width
  double sign;           ///< +1 entering, −1 leaving
  std::uint32_t piece;
  std::uint16_t medium;
};

/// Segments of the rays of one slice, in the form that mpa::integrate takes. Scratch of one worker.
struct MediaScratch {
  std::vector<Crossing> crossings;
  std::vector<MediaBoundary> boundaries, moved;
  std::vector<std::uint32_t> ray_begin, ray_row, bin;
  std::vector<float> length_m, extinction, extinction_back, scattering;
  std::vector<std::uint32_t> ray_k;    ///< k of each ray
  std::vector<double> contributions;   ///< of each segment; for layers only
  void clear();
};

/// A coarser sampling of the same rays that a slice is part of, and its row of bins.
struct MediaSubset {
  int k_step = 1;
  SliceGroup group;
  MediaScratch* scratch = nullptr;
  std::span<double> bins;
};

/// Homogeneous translucent solids of a scene. Between entry and exit a medium is constant, so nothing
/// is marched: each ray is cut at the faces it crosses and at the borders of bins, and each piece is
/// integrated in closed form. Where solids overlap, their extinctions and scatterings add.
class Media {
 public:
  /// Takes the closed translucent pieces of the scene; `scene_origin_m` as in ViewRays.
  Media(const Scene& scene, const glm::dvec3& scene_origin_m);

  bool empty() const { return triangles_.empty(); }
  const Box& box_m() const { return box_; }  ///< world coordinates
  std::uint64_t memory_bytes() const { return tracer_ ? tracer_->memory_bytes() : 0; }

  /// Attenuates the γ of the slice's samples by the media in front of them, and deposits what the media
  /// themselves scatter, in the units of deposit_slice(). Only rays k in [first, end) are looked at: those
  /// that may meet the media's box. The slice must be complete; `weight` is how much it counts. `layers`, unless null, gets what the image
  /// gets, and is told where media hide the reference plane: where less than half of the power comes back.
  void apply(const ViewRays& rays, Integrator integrator, int first, int end, double weight, Slice& slice,
             MediaScratch& scratch, std::span<double> bins, LayerRow* layers = nullptr,
             std::span<const MediaSubset> subsets = {}) const;

 private:
  /// Two-way optical depth of what lies nearer than a bin coordinate.
  double depth_before(double bin, double spacing_m, std::span<const MediaBoundary> boundaries) const;

  /// What a ray stands for: so many rays and slices of a weight, and how far (slices) these lie from its own.
  struct Cell {
    double weight = 1.0, rays = 1.0, slices = 1.0, shift = 0.0;
  };
  /// Appends the segments of a ray, or of several spread over its cell where faces are steep.
  void append_ray(const Cell& cell, double spacing_m, double end_of_ray, double n_bins, int k,
                  std::span<const MediaBoundary> boundaries, MediaScratch& scratch) const;

  /// Leaves the faces that ray k of the slice crosses in scratch.boundaries, in order of range.
  void find_boundaries(const ViewRays& rays, const Slice& slice, int k, MediaScratch& scratch) const;

  std::vector<glm::vec3> vertices_m_;
  std::vector<glm::uvec3> triangles_;
  std::vector<std::uint32_t> piece_;     ///< per triangle
  std::vector<std::uint16_t> medium_;    ///< per triangle
  std::vector<Material> media_;
  bool two_way_equal_ = true;            ///< κ⁺ = κ⁻ everywhere: no second array
  Box box_;
  std::unique_ptr<RayTracer> tracer_;
};

/// A scene made ready for ray casting: what the surface engine builds once for all views.
class SurfaceScene {
 public:
  /// `scene` must outlive it.
  explicit SurfaceScene(const Scene& scene);

  /// Of the triangles in `opaque`; found when layers are asked for the first time.
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

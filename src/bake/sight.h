// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <glm/glm.hpp>

#include "columns.h"
#include "sarnerf/bake/surface_mesh.h"
#include "sarnerf/core/parallel.h"
#include "sarnerf/geometry/acquisition.h"
#include "sarnerf/trace/ray_tracer.h"

namespace sarnerf {

/// A point on a surface.
struct SurfaceSample {
  glm::dvec3 point_m;
  glm::dvec3 normal;  ///< outward, unit length
  std::uint32_t triangle;
};

/// n points that each represent an equal area: one per stratum, an n-th of the surface's area, triangle after triangle,
/// spread within strata and triangles by a low-discrepancy sequence. Always the same for the same mesh; empty when it
/// has no area. Expects valid vertex indices and finite coordinates.
std::vector<SurfaceSample> sample_surface(const SurfaceMesh& mesh, std::size_t n);

/// Determines by rays which samples of a surface are buried, and which of them radars can see. Rays use float32
/// coordinates relative to the centre of the surface's box, in units of half its diagonal, so that neither offset nor
/// scale of the world matters.
class Sight {
 public:
  /// The mesh, whose box is `box_m`, must outlive this. Its first `n_solid` triangles bound closed pieces and are
  /// seen from outside, the rest are thin shells, seen from both sides.
  Sight(const SurfaceMesh& mesh, const Box& box_m, std::size_t n_solid);

  /// Whether the outer side of the sample lies inside a solid. `crossings` is scratch space.
  bool buried(const SurfaceSample& sample, std::vector<Crossing>& crossings) const;

  /// Per sample, 1 when some view sees it; see score(). Throws Interrupted on request. Cost: a ray per sample and
  /// view that it faces, up to the first that sees it.
  std::vector<std::uint8_t> seen(std::span<const SurfaceSample> samples, std::span<const Acquisition> views,
                                 const Monitor& monitor) const;

  /// Per sample, 1 when some view sees it alone: in its pixel, no gap of more than a pixel's width separates the samples that the view
  /// sees there in elevation (perpendicular to the ray). Elsewhere two surfaces, or more, are laid over one another. Samples must be
  /// dense: several in a pixel. Throws Interrupted on request. Cost: a ray per sample and view.
  std::vector<std::uint8_t> seen_alone(std::span<const SurfaceSample> samples, std::span<const Acquisition> views,
                                       const Monitor& monitor) const;

  /// Per point, 1 when some view's ray reaches it and meets no surface before. Throws Interrupted on request. Cost as for seen().
  std::vector<std::uint8_t> reached(std::span<const glm::dvec3> points_m, std::span<const Acquisition> views,
                                    const Monitor& monitor) const;

 private:
  struct View {
    Acquisition acquisition;
    RadarFrame frame;
  };

  /// The sample just above its surface along `normal`, in the rays' coordinates.
  glm::vec3 lifted(const SurfaceSample& sample, const glm::dvec3& normal) const;
  bool sees(const View& view, const SurfaceSample& sample) const;
  bool reaches(const View& view, const glm::dvec3& point_m) const;
  /// Per item, 1 if one of the views passes the test. The view that passed last is tested first: neighbours are seen alike.
  template <class Item, class Test>
  std::vector<std::uint8_t> by_any(std::span<const Item> items, std::span<const Acquisition> views, const Monitor& monitor,
                                   const char* stage, Test&& test) const;

  glm::dvec3 centre_m_;
  double unit_m_;
  std::size_t n_solid_;
  std::vector<glm::vec3> vertices_;  ///< one more than the mesh has, which RayTracer needs
  RayTracer tracer_;
};

/// Space outside of a true solid that no ray of any view reaches before it meets the true surface. Images hold nothing about it:
/// a solid that fills it explains them as well as the truth does.
struct HiddenSpace {
  double extracted_m3 = 0.0;  ///< of it, what an extracted solid fills
  double whole_m3 = 0.0;      ///< all of it within the truth's box: what the best hull without a prior would fill
};

/// Measures it above the truth's lowest point, on points of every kStride-th vertical line at as wide steps. `truth_sight` is of
/// the true surface. Throws Interrupted. Cost: a ray for each point and view, up to the first that reaches it.
HiddenSpace hidden_space(const Columns& extracted, const Columns& truth, const Box& truth_box_m, const Sight& truth_sight,
                         std::span<const Acquisition> views, const Monitor& monitor);

}  // namespace sarnerf

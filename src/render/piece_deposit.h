// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "slice_frame.h"

namespace sarnerf {

/// A flat opaque face as it answers the radar of one view.
struct FaceLook {
  const Material* material = nullptr;
  const glm::dmat4* object_from_world = nullptr;  ///< of its texture
  bool two_sided = false;                         ///< thin shell
  glm::dvec3 normal{0.0};                         ///< unit vector: along h, along v, along k

  /// −n·d.
  double cosine(double tangent) const {
    return -(normal.z + tangent * normal.y) / std::sqrt(1.0 + tangent * tangent);
  }
  /// γ without texture (docs/equations.md, E3).
  double brightness(double tangent) const;
};

/// The face of a mesh; a face without area has a zero normal, which scatters nothing.
FaceLook look_of_face(const Scene& scene, std::uint32_t triangle, const RadarFrame& frame);
FaceLook look_of_ground(const Scene& scene, const RadarFrame& frame);

/// Spreads what visible pieces of faces scatter over one row's range bins: γ dδ, divided where the checker's
/// squares meet, then until range and γ are so straight that no bin is wrong by a millionth.
class PieceDeposit {
 public:
  /// `width_m`: of a slice along track, over which the range of a face at one ray angle moves as its plane says.
  PieceDeposit(const SliceFrame& frame, double width_m, std::span<double> bins)
      : frame_(frame), width_m_(width_m), bins_(bins) {}

  /// Deposits the rays between two tangents of the slice at along-track coordinate a, times `weight`.
  void add(const FaceLook& look, const SliceLine& line, double along_m, double first, double last, double weight);

 private:
  struct Ray {
    double tangent, bin, gamma;
  };
  Ray ray_at(const FaceLook& look, const SliceLine& line, double tangent) const {
    return {tangent, frame_.bin_at(line, tangent), look.brightness(tangent)};
  }
  void divide(const FaceLook& look, const SliceLine& line, const Ray& first, const Ray& last, double weight);
  /// Leaves the tangents at which the line passes from one square to the next in squares_, in order, with both
  /// ends; false if the squares are too fine to be told apart.
  bool find_squares(const FaceLook& look, const SliceLine& line, double along_m, double first, double last);

  const SliceFrame& frame_;
  double width_m_;
  std::span<double> bins_;
  std::vector<double> squares_;
};

}  // namespace sarnerf

// SPDX-License-Identifier: Apache-2.0
#include "piece_deposit.h"

#include <algorithm>
#include <cmath>

#include "deposit.h"

namespace sarnerf {
namespace {

/// Largest departure from a straight line between range and angle (bins).
constexpr double kBinTolerance = 4e-7;
/// Largest relative change of γ in a part, times the bins that it spans: what a uniform part puts into the wrong
/// one of two bins is an eighth of that, in units of a bin's power.
constexpr double kGammaTolerance = 4e-6;
/// Parts this narrow (m) across the rays are not divided: what is so narrow and still bent is seen edge-on.
constexpr double kNarrowest_m = 1e-6;
/// As for the surface engine: a face seen exactly edge-on has no finite slope, and no area either.
constexpr double kSteepest = 1e-6;
/// Squares of a checker within one piece beyond which only their mean counts, which is 1.
constexpr double kMostSquares = 20'000.0;

glm::dvec3 along_radar(const glm::dvec3& world, const RadarFrame& frame) {
  return {glm::dot(world, frame.h), glm::dot(world, frame.v), glm::dot(world, frame.k)};
}

}  // namespace

double FaceLook::brightness(double tangent) const {
  const double c = two_sided ? std::abs(cosine(tangent)) : cosine(tangent);
  if (!(c > 0.0)) return 0.0;
  const double p = material->exponent;
  return material->gamma0 * (p == 0.0 ? 1.0 : p == 1.0 ? c : std::pow(c, p));
}

FaceLook look_of_face(const Scene& scene, std::uint32_t triangle, const RadarFrame& frame) {
  const glm::uvec3& c = scene.mesh.triangles[triangle];
  const auto& v = scene.mesh.vertices_m;
  const glm::dvec3 normal = glm::cross(v[c.y] - v[c.x], v[c.z] - v[c.x]);
  const double length = glm::length(normal);
  const Piece& piece = scene.pieces[scene.mesh.piece[triangle]];
  return {&scene.materials[scene.mesh.material[triangle]], &scene.objects[piece.object].object_from_world,
          !piece.closed, length > 0.0 ? along_radar(normal / length, frame) : glm::dvec3(0.0)};
}

FaceLook look_of_ground(const Scene& scene, const RadarFrame& frame) {
  static const glm::dmat4 world(1.0);
  return {&scene.materials[scene.ground->material], &world, false, along_radar({0.0, 1.0, 0.0}, frame)};
}

bool PieceDeposit::find_squares(const FaceLook& look, const SliceLine& line, double along_m, double first,
                                double last) {
  squares_.assign({first, last});
  const Texture& texture = look.material->texture;
  const auto square_at = [&](double tangent) {
    const glm::dvec4 world(frame_.world_m(along_m, line, tangent), 1.0);
    return (glm::dvec3(*look.object_from_world * world) - texture.effective_origin_m()) / texture.period_m;
  };
  // Along a straight line the squares are crossed at regular distances.
  const double f_first = line.fraction_at(first, frame_.r), f_last = line.fraction_at(last, frame_.r);
  const glm::dvec3 p = square_at(first), q = square_at(last);
  const glm::dvec3 n_crossed = glm::abs(q - p);
  if (!(n_crossed.x + n_crossed.y + n_crossed.z <= kMostSquares)) return false;
  for (int axis = 0; axis < 3; ++axis) {
    const auto [low, high] = std::minmax(p[axis], q[axis]);
    for (double border = std::floor(low) + 1.0; border < high; ++border) {
      const double f = f_first + (f_last - f_first) * (border - p[axis]) / (q[axis] - p[axis]);
      const double depth_m = frame_.r + line.depth_m + f * line.depth_step_m;
      squares_.push_back(std::clamp((line.across_m + f * line.across_step_m) / depth_m, first, last));
    }
  }
  std::sort(squares_.begin(), squares_.end());
  return true;
}

void PieceDeposit::add(const FaceLook& look, const SliceLine& line, double along_m, double first, double last,
                       double weight) {
  if (!(look.brightness(0.5 * (first + last)) > 0.0) || !(first < last)) return;
  const Texture& texture = look.material->texture;
  if (texture.kind == Texture::Kind::none || texture.contrast == 0.0) {
    divide(look, line, ray_at(look, line, first), ray_at(look, line, last), weight);
    return;
  }
  const bool drawn = find_squares(look, line, along_m, first, last);
  for (std::size_t n = 0; n + 1 < squares_.size(); ++n) {
    const double from = squares_[n], to = squares_[n + 1];
    if (!(from < to)) continue;
    const glm::dvec4 middle(frame_.world_m(along_m, line, 0.5 * (from + to)), 1.0);
    const double factor = drawn ? texture.factor(glm::dvec3(*look.object_from_world * middle)) : 1.0;
    divide(look, line, ray_at(look, line, from), ray_at(look, line, to), weight * factor);
  }
}

void PieceDeposit::divide(const FaceLook& look, const SliceLine& line, const Ray& first, const Ray& last,
                          double weight) {
  const Ray middle = ray_at(look, line, 0.5 * (first.tangent + last.tangent));
  const double bent = std::abs(middle.bin - 0.5 * (first.bin + last.bin));
  const double change = std::abs(last.gamma - first.gamma) * std::abs(last.bin - first.bin);
  const double across_m = (last.tangent - first.tangent) * frame_.r;
  if (across_m > kNarrowest_m && (bent > kBinTolerance || change > kGammaTolerance * middle.gamma)) {
    divide(look, line, first, middle, weight);
    divide(look, line, middle, last, weight);
    return;
  }
  const double gamma = (first.gamma + 4.0 * middle.gamma + last.gamma) / 6.0;
  const double per_m = look.normal.x / std::max(std::abs(look.cosine(middle.tangent)), kSteepest);
  deposit_trapezoid(bins_, first.bin, last.bin, width_m_ * per_m * frame_.bins_per_m,
                    weight * gamma * SliceFrame::angle_between(first.tangent, last.tangent));
}

}  // namespace sarnerf

// SPDX-License-Identifier: Apache-2.0
// Shapes on which surfaces are judged. Each kind has a difficulty that boxes do not have.
#include "scene_pieces.h"

#include <algorithm>

namespace sarnerf::bench {

namespace {

constexpr const char* kMaterial = "body";

/// Thickness of thin members (m): two voxels of half a range bin of 0.3 m.
constexpr double kThin_m = 0.3;

/// The solid along a closed path of rings of equally many corners, each counter-clockwise seen from the one behind it.
ScenePiece closed_loft(const std::string& group, const std::vector<Ring>& rings) {
  ScenePiece piece{group, kMaterial, {}, {}};
  for (const Ring& ring : rings) piece.vertices_m.insert(piece.vertices_m.end(), ring.begin(), ring.end());
  const auto n = static_cast<std::uint32_t>(rings.front().size()), n_rings = static_cast<std::uint32_t>(rings.size());
  for (std::uint32_t r = 0; r < n_rings; ++r) {
    const std::uint32_t a = r * n, b = (r + 1) % n_rings * n;
    for (std::uint32_t i = 0; i < n; ++i) {
      const std::uint32_t next = (i + 1) % n;
      piece.triangles.emplace_back(a + i, a + next, b + next);
      piece.triangles.emplace_back(a + i, b + next, b + i);
    }
  }
  return piece;
}

void stand_on_ground(Pieces& pieces) {
  const double lowest = box_of(pieces).min.y;
  for (ScenePiece& piece : pieces) move(piece, {0.0, -lowest, 0.0});
}

/// A ring about an axis up to 60° off the vertical, of a round or angular cross-section; in half of all cases with a block through
/// its rim.
Pieces random_ring(Random& random) {
  const double half_length_m = random.uniform(2.4, 3.2), half_width_m = half_length_m * random.uniform(0.8, 1.0);
  const double across_m = random.uniform(0.7, 1.1), up_m = random.uniform(0.6, 1.2);
  const int n_corners = random.chance(0.5) ? 24 : random.whole(4, 6);
  const double tilt_rad = rad_from_deg(random.uniform(0.0, 60.0));
  constexpr int kAround = 72;
  std::vector<Ring> rings;
  for (int n = 0; n < kAround; ++n) {
    const double angle = 2.0 * kPi * n / kAround;
    const glm::dvec3 out{std::cos(angle), 0.0, std::sin(angle)};
    rings.push_back(polygon({half_length_m * out.x, 0.0, half_width_m * out.z}, across_m * out, {0.0, up_m, 0.0}, n_corners));
  }
  Pieces pieces{closed_loft("ring", rings)};
  for (glm::dvec3& p : pieces.front().vertices_m)
    p = {p.x, std::cos(tilt_rad) * p.y - std::sin(tilt_rad) * p.z, std::sin(tilt_rad) * p.y + std::cos(tilt_rad) * p.z};
  stand_on_ground(pieces);
  if (random.chance(0.5)) {
    const double half_m = random.uniform(0.5, 0.9), height_m = random.uniform(2.6, 4.5);
    pieces.push_back(box("block", kMaterial, {half_length_m - half_m, 0.0, -half_m}, {half_length_m + half_m, height_m, half_m}));
  }
  return pieces;
}

/// A foot that carries a wider body, set to one side.
Pieces random_overhang(Random& random) {
  const double foot_m = random.uniform(1.0, 1.6), under_m = random.uniform(1.2, 2.4), height_m = under_m + random.uniform(1.3, 2.5);
  const int n_foot = random.whole(4, 8), n_body = random.whole(4, 8);
  const glm::dvec2 half{random.uniform(3.0, 4.2), random.uniform(2.0, 3.2)};
  const double aside_m = random.uniform(0.0, 0.5) * (half.x - foot_m), taper = random.uniform(0.6, 1.0);
  const auto ring = [&](double y, double scale) {
    return polygon({aside_m, y, 0.0}, {0.0, 0.0, scale * half.y}, {scale * half.x, 0.0, 0.0}, n_body);
  };
  const auto foot = [&](double y) { return polygon({0.0, y, 0.0}, {0.0, 0.0, foot_m}, {foot_m, 0.0, 0.0}, n_foot); };
  return {loft("foot", kMaterial, {foot(0.0), foot(under_m + 0.3)}), loft("body", kMaterial, {ring(under_m, 1.0), ring(height_m, taper)})};
}

/// A block that carries a thin plate, and a thin wall beside it.
Pieces random_thin(Random& random) {
  const double length_m = random.uniform(6.5, 9.0), width_m = random.uniform(3.5, 5.0);
  const double block_m = random.uniform(2.0, 3.0), height_m = random.uniform(1.5, 2.5), plate_m = height_m - 0.1;
  const double wall_m = height_m + random.uniform(1.2, 2.5), at_m = random.uniform(-0.35, 0.35) * width_m;
  return {box("block", kMaterial, {-0.5 * length_m, 0.0, -0.4 * width_m}, {-0.5 * length_m + block_m, height_m, 0.4 * width_m}),
          box("plate", kMaterial, {-0.5 * length_m - 0.2, plate_m, -0.5 * width_m}, {0.3 * length_m, plate_m + kThin_m, 0.5 * width_m}),
          box("wall", kMaterial, {-0.1 * length_m, 0.0, at_m}, {0.5 * length_m, wall_m, at_m + kThin_m})};
}

/// Two to four beams whose tops meet.
Pieces random_slanted(Random& random) {
  const double height_m = random.uniform(3.5, 6.0), top_m = random.uniform(0.6, 0.9);
  const int n_beams = random.whole(2, 4);
  const double first_rad = random.angle_rad();
  Pieces pieces;
  for (int n = 0; n < n_beams; ++n) {
    const double angle = first_rad + 2.0 * kPi * (n + random.uniform(-0.15, 0.15)) / n_beams, away_m = random.uniform(2.4, 3.6);
    const double half_m = random.uniform(0.5, 0.9);
    const int n_corners = random.whole(4, 7);
    const glm::dvec3 foot{away_m * std::cos(angle), 0.0, away_m * std::sin(angle)};
    // Each top lies a little lower than the one before: no two have a face in common.
    const glm::dvec3 top{0.15 * foot.x, height_m - 0.2 * n, 0.15 * foot.z};
    pieces.push_back(loft("beam_" + std::to_string(n + 1), kMaterial,
                          {polygon(foot, {0, 0, half_m}, {half_m, 0, 0}, n_corners),
                           polygon(top, {0, 0, top_m}, {top_m, 0, 0}, n_corners)}));
  }
  return pieces;
}

/// A tube along a bent line, round at its ends.
Pieces random_smooth(Random& random) {
  const double reach_m = random.uniform(3.0, 4.0), bend_m = random.uniform(0.8, 2.2), rise_m = random.uniform(0.0, 2.0);
  const double radius_m = random.uniform(0.9, 1.5), bulge = random.uniform(-0.3, 0.4), bulges = random.whole(1, 3);
  constexpr int kRings = 64, kCorners = 40;
  const auto centre = [&](double t) {  // t from −1 to 1
    return glm::dvec3(reach_m * t, rise_m * t * t, bend_m * std::sin(1.6 * t));
  };
  std::vector<Ring> rings;
  for (int n = 0; n <= kRings; ++n) {
    // Rings are denser towards the tips, where the width changes fastest.
    const double t = -std::cos(kPi * n / kRings);
    const glm::dvec3 along = glm::normalize(centre(t + 1e-3) - centre(t - 1e-3));
    const glm::dvec3 u = glm::normalize(glm::cross(glm::dvec3(0, 1, 0), along)), v = glm::cross(along, u);
    const double r = radius_m * std::sqrt(1.0 - t * t) * (1.0 + bulge * std::cos(kPi * bulges * t));
    if (n == 0 || n == kRings) rings.push_back({centre(t)});
    else rings.push_back(polygon(centre(t), r * u, r * v, kCorners));
  }
  Pieces pieces{loft("tube", kMaterial, rings)};
  stand_on_ground(pieces);
  return pieces;
}

}  // namespace

Pieces random_shape(Random& random, SceneKind kind) {
  Pieces pieces;
  switch (kind) {
    case SceneKind::ring: pieces = random_ring(random); break;
    case SceneKind::overhang: pieces = random_overhang(random); break;
    case SceneKind::thin: return random_thin(random);  // scaled, its members would have another thickness
    case SceneKind::slanted: pieces = random_slanted(random); break;
    default: pieces = random_smooth(random); break;
  }
  const glm::dvec3 size = box_of(pieces).size();
  fit(pieces, std::clamp(std::max(size.x, size.z), 6.0, 10.0), std::clamp(size.y, 2.5, 6.5));
  return pieces;
}

}  // namespace sarnerf::bench

// SPDX-License-Identifier: Apache-2.0
#include "lower_envelope.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "sarnerf/core/error.h"

namespace sarnerf {

namespace {

/// Faces seen so nearly edge-on that their ends are this close (m) across the rays are left out.
constexpr double kThinnest_m = 1e-10;

}  // namespace

std::vector<glm::dvec3> radar_vertices(const Scene& scene, const Acquisition& view) {
  const RadarFrame frame = radar_frame(view);
  std::vector<glm::dvec3> seen;
  seen.reserve(scene.mesh.vertices_m.size());
  for (const glm::dvec3& world_m : scene.mesh.vertices_m) {
    const glm::dvec3 q = world_m - view.aim_m;
    seen.push_back({glm::dot(q, frame.h), glm::dot(q, frame.v), glm::dot(q, frame.k)});
    if (view.slant_range_m + seen.back().z <= 0.0) {
      char text[200];
      std::snprintf(text, sizeof text,
                    "the scene reaches behind the radar, which is %.6g m from the aim point: raise the altitude "
                    "or check the scene's units",
                    view.slant_range_m);
      throw GeometryError(text);
    }
  }
  return seen;
}

SlicedFaces::SlicedFaces(const Scene& scene, std::span<const glm::dvec3> vertices_m,
                         const std::vector<std::uint32_t>& triangles, const Acquisition& view)
    : scene_(scene),
      vertices_m_(vertices_m),
      slant_range_m_(view.slant_range_m),
      of_row_(static_cast<std::size_t>(view.n_azimuth)) {
  const double start_m = view.row_offset_m(-0.5), last_row = view.n_azimuth - 1.0;
  // Slices near a row's border may be rounded across it.
  constexpr double kSlack = 1e-6;
  for (const std::uint32_t t : triangles) {
    const glm::uvec3& corners = scene.mesh.triangles[t];
    const auto [low_m, high_m] = std::minmax({vertices_m[corners.x].x, vertices_m[corners.y].x, vertices_m[corners.z].x});
    const double first = std::max(0.0, std::floor((low_m - start_m) / view.azimuth_spacing_m - kSlack));
    const double last = std::min(last_row, std::floor((high_m - start_m) / view.azimuth_spacing_m + kSlack));
    for (double i = first; i <= last; ++i) of_row_[static_cast<std::size_t>(i)].push_back(t);
  }
}

void SlicedFaces::cut(int i, double along_m, std::vector<SliceLine>& lines) const {
  lines.clear();
  const double r = slant_range_m_;
  for (const std::uint32_t t : of_row_[static_cast<std::size_t>(i)]) {
    const glm::uvec3& corners = scene_.mesh.triangles[t];
    glm::dvec2 ends[2];  // across, depth
    int n_ends = 0;
    for (int c = 0; c < 3; ++c) {
      const glm::dvec3& p = vertices_m_[corners[c]];
      const glm::dvec3& q = vertices_m_[corners[(c + 1) % 3]];
      const bool p_before = p.x < along_m, q_before = q.x < along_m;
      if (p_before == q_before) continue;
      // Interpolates from the same end in both triangles of an edge.
      const glm::dvec3 &from = p_before ? p : q, &to = p_before ? q : p;
      const double fraction = (along_m - from.x) / (to.x - from.x);
      ends[n_ends++] = glm::dvec2(from.y, from.z) + fraction * (glm::dvec2(to.y, to.z) - glm::dvec2(from.y, from.z));
    }
    if (n_ends != 2) continue;
    double first = ends[0].x / (r + ends[0].y), last = ends[1].x / (r + ends[1].y);
    if (first > last) {
      std::swap(first, last);
      std::swap(ends[0], ends[1]);
    }
    if (!((last - first) * r > kThinnest_m)) continue;
    lines.push_back({first, last, ends[0].y, ends[0].x, ends[1].y - ends[0].y, ends[1].x - ends[0].x, t});
  }
}

namespace {

/// Where two lines cross, a third one counts as nearer only by this much, so that rounding alone divides no interval.
constexpr double kNearer_m = 1e-9;
/// Each division finds another line; a greater depth of divisions is due to rounding.
constexpr int kDeepest = 64;

}  // namespace

double crossing(double first, double last, double before_m, double behind_m, glm::dvec2 first_depths_m,
                glm::dvec2 last_depths_m) {
  // Differences of inverse depths are linear in the tangent.
  const double g_first = before_m / (first_depths_m.x * first_depths_m.y);
  const double g_last = behind_m / (last_depths_m.x * last_depths_m.y);
  return std::clamp(first + (last - first) * (g_first / (g_first + g_last)), first, last);
}

std::uint32_t LowerEnvelope::nearest(double tangent) const {
  std::uint32_t best = active_.front();
  double best_m = depth_at(best, tangent);
  for (std::size_t n = 1; n < active_.size(); ++n) {
    const double depth_m = depth_at(active_[n], tangent);
    if (depth_m < best_m || (depth_m == best_m && active_[n] < best)) {
      best = active_[n];
      best_m = depth_m;
    }
  }
  return best;
}

void LowerEnvelope::add(double first, double last, std::uint32_t line) {
  if (!(first < last)) return;
  if (!pieces_->empty() && pieces_->back().line == line && pieces_->back().last == first) {
    pieces_->back().last = last;
  } else {
    pieces_->push_back({first, last, line});
  }
}

void LowerEnvelope::divide(double first, std::uint32_t a, double last, std::uint32_t b, int depth) {
  if (a == b) return add(first, last, a);
  const glm::dvec2 at_first(depth_at(a, first), depth_at(b, first)), at_last(depth_at(a, last), depth_at(b, last));
  const double before_m = at_first.y - at_first.x, behind_m = at_last.x - at_last.y;
  if (!(before_m + behind_m > 0.0)) return add(first, last, a);  // they coincide
  const double middle = crossing(first, last, before_m, behind_m, r_ + at_first, r_ + at_last);
  if (depth < kDeepest && first < middle && middle < last) {
    const std::uint32_t c = nearest(middle);
    if (depth_at(c, middle) < std::min(depth_at(a, middle), depth_at(b, middle)) - kNearer_m) {
      divide(first, a, middle, c, depth + 1);
      divide(middle, c, last, b, depth + 1);
      return;
    }
  }
  add(first, middle, a);
  add(middle, last, b);
}

void LowerEnvelope::find(std::span<const SliceLine> lines, std::vector<VisiblePiece>& pieces) {
  lines_ = lines;
  pieces_ = &pieces;
  pieces.clear();
  ends_.clear();
  active_.clear();
  for (std::uint32_t n = 0; n < lines.size(); ++n) {
    ends_.push_back({lines[n].first, n, true});
    ends_.push_back({lines[n].last, n, false});
  }
  std::sort(ends_.begin(), ends_.end(), [](const End& a, const End& b) { return a.tangent < b.tangent; });
  for (std::size_t n = 0; n < ends_.size();) {
    const double first = ends_[n].tangent;
    for (; n < ends_.size() && ends_[n].tangent == first; ++n) {
      if (ends_[n].begins) {
        active_.push_back(ends_[n].line);
      } else {
        const auto gone = std::find(active_.begin(), active_.end(), ends_[n].line);
        *gone = active_.back();
        active_.pop_back();
      }
    }
    if (active_.empty() || n == ends_.size()) continue;
    const double last = ends_[n].tangent;
    divide(first, nearest(first), last, nearest(last), 0);
  }
}

}  // namespace sarnerf

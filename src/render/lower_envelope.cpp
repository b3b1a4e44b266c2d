// SPDX-License-Identifier: Apache-2.0
#include "lower_envelope.h"

#include <algorithm>

namespace sarnerf {
namespace {

/// A third line counts as nearer where two cross if it is by this much: rounding alone divides nothing.
constexpr double kNearer_m = 1e-9;
/// Each division finds another line; more than this many in turn are rounding.
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

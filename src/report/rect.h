// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>

namespace sarnerf {

/// A place in the picture (pixels), y downwards.
struct Spot {
  double x = 0.0, y = 0.0;
};

/// A piece of a straight line (pixels).
struct Stroke {
  Spot from, to;
};

/// An upright rectangle (pixels).
struct Rect {
  double x0 = 0.0, y0 = 0.0, x1 = 0.0, y1 = 0.0;

  double width() const { return x1 - x0; }
  double height() const { return y1 - y0; }
  Rect grown(double by) const { return {x0 - by, y0 - by, x1 + by, y1 + by}; }
  bool holds(const Rect& r) const { return x0 <= r.x0 && r.x1 <= x1 && y0 <= r.y0 && r.y1 <= y1; }
  bool holds(Spot p) const { return x0 <= p.x && p.x <= x1 && y0 <= p.y && p.y <= y1; }
};

inline bool overlap(const Rect& a, const Rect& b) {
  return a.x0 < b.x1 && b.x0 < a.x1 && a.y0 < b.y1 && b.y0 < a.y1;
}

/// Cuts a stroke to what lies within the rectangle (Liang and Barsky); false when nothing does.
inline bool clip(Stroke& stroke, const Rect& within) {
  const Spot from = stroke.from;
  const double dx = stroke.to.x - from.x, dy = stroke.to.y - from.y;
  double enters = 0.0, leaves = 1.0;
  const auto side = [&](double towards, double distance) {
    if (towards == 0.0) return distance >= 0.0;
    const double t = distance / towards;
    if (towards < 0.0) {
      enters = std::max(enters, t);
    } else {
      leaves = std::min(leaves, t);
    }
    return enters <= leaves;
  };
  if (!side(-dx, from.x - within.x0) || !side(dx, within.x1 - from.x) ||
      !side(-dy, from.y - within.y0) || !side(dy, within.y1 - from.y)) {
    return false;
  }
  stroke.to = {from.x + leaves * dx, from.y + leaves * dy};
  stroke.from = {from.x + enters * dx, from.y + enters * dy};
  return true;
}

inline bool crosses(Stroke stroke, const Rect& rect) { return clip(stroke, rect); }

}  // namespace sarnerf

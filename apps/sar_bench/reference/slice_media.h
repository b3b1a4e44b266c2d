// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <span>
#include <vector>

#include "lower_envelope.h"

namespace sarnerf {

/// The homogeneous translucent solids of a scene in one slice. They are integrated ray by ray in closed form
/// (docs/method/equations.md, E1, exact). Rays are so close that the ranges of faces hardly change between them.
/// Scratch of one worker.
class SliceMedia {
 public:
  SliceMedia(const Scene& scene, const SliceFrame& frame, const Acquisition& view);

  /// `lines`: cuts of the closed translucent pieces. They must stay as they are until the slice is done.
  void begin_slice(std::span<const SliceLine> lines);

  /// Adds the power that the media scatter to `bins`. Calls part(line, first, last, weight) for each part of the
  /// visible pieces of opaque `lines`; `weight` is the two-way transmittance of the media before it.
  template <class F>
  void run(std::span<const VisiblePiece> pieces, std::span<const SliceLine> lines, std::span<double> bins, F&& part);

 private:
  struct Face {
    double enters;  ///< +1 entering, −1 leaving
    std::uint32_t piece;
    const Material* medium;
  };
  struct Boundary {
    double bin;
    std::uint32_t line;
  };

  /// Sets active_ to the lines that rays meet between `first` and the next end of a line.
  void advance(double first);
  /// Number of parts into which the rays between two tangents are divided.
  int n_parts(double first, double last) const;
  /// Deposits the power that media scatter along a ray up to the bin coordinate `end`, times `weight`. Returns the
  /// two-way transmittance to there.
  double integrate(double tangent, double end, double weight, std::span<double> bins);

  const Scene& scene_;
  const SliceFrame& frame_;
  double spacing_m_, pixel_rad_;
  std::span<const SliceLine> lines_;
  std::vector<Face> faces_;               ///< per line
  std::vector<std::uint32_t> by_first_;   ///< lines in order of their first ray
  std::vector<double> borders_;           ///< tangents at which anything begins or ends
  std::size_t n_begun_ = 0;
  std::vector<std::uint32_t> active_;
  std::vector<Boundary> boundaries_;
  std::vector<int> inside_;               ///< per piece of the scene: faces entered less faces left
};

template <class F>
void SliceMedia::run(std::span<const VisiblePiece> pieces, std::span<const SliceLine> lines, std::span<double> bins,
                     F&& part) {
  if (lines_.empty()) {
    for (const VisiblePiece& p : pieces) part(p.line, p.first, p.last, 1.0);
    return;
  }
  borders_.clear();
  for (const SliceLine& line : lines_) borders_.insert(borders_.end(), {line.first, line.last});
  for (const VisiblePiece& p : pieces) borders_.insert(borders_.end(), {p.first, p.last});
  std::sort(borders_.begin(), borders_.end());
  borders_.erase(std::unique(borders_.begin(), borders_.end()), borders_.end());

  std::size_t next = 0;
  for (std::size_t n = 0; n + 1 < borders_.size(); ++n) {
    const double first = borders_[n], last = borders_[n + 1];
    while (next < pieces.size() && pieces[next].last <= first) ++next;
    const VisiblePiece* piece = next < pieces.size() && pieces[next].first <= first ? &pieces[next] : nullptr;
    advance(first);
    if (active_.empty()) {
      if (piece != nullptr) part(piece->line, first, last, 1.0);
      continue;
    }
    const int parts = n_parts(first, last);
    const auto border = [&](int q) { return q == parts ? last : first + (last - first) * q / parts; };
    for (int q = 0; q < parts; ++q) {
      const double from = border(q), to = border(q + 1), middle = 0.5 * (from + to);
      const double end = piece != nullptr ? frame_.bin_at(lines[piece->line], middle)
                                          : std::numeric_limits<double>::infinity();
      const double through = integrate(middle, end, SliceFrame::angle_between(from, to), bins);
      if (piece != nullptr) part(piece->line, from, to, through);
    }
  }
}

}  // namespace sarnerf

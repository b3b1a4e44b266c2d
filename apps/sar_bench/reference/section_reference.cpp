// SPDX-License-Identifier: Apache-2.0
#include "section_reference.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "lower_envelope.h"
#include "sarnerf/core/error.h"
#include "sarnerf/core/parallel.h"
#include "sarnerf/geometry/ray_grid.h"
#include "slice_media.h"
#include "sarnerf/mpa/deposit.h"

namespace sarnerf {

namespace {

/// SliceLine::face of the ground.
constexpr std::uint32_t kGroundFace = 0xfffffffeu;

/// The cut of slices through the infinite ground plane: the same line in all of them.
class SliceGround {
 public:
  SliceGround(const Acquisition& view, double height_m);

  /// The part of the ground within the range bins; none if they end before they reach it.
  const std::optional<SliceLine>& line() const { return line_; }

  /// Replaces `all` by `pieces`, the visible pieces of `lines`, plus the ground where it is nearer and, within the
  /// range bins, where there is nothing else. `ground`: index of line() among the lines. A piece no more than a
  /// millimetre behind the ground takes precedence: floors and roads lie in the ground's plane.
  void cover(std::span<const VisiblePiece> pieces, std::span<const SliceLine> lines, std::uint32_t ground,
             std::vector<VisiblePiece>& all) const;

 private:
  double plane_depth(double tangent) const;
  /// Depth along k relative to the aim point (m); infinite above the horizon and behind the nadir.
  double depth_at(double tangent) const;

  double slant_range_m_, sine_, cosine_, above_ground_m_;
  std::optional<SliceLine> line_;
};

constexpr double kCoplanar_m = 1e-3;

SliceGround::SliceGround(const Acquisition& view, double height_m)
    : slant_range_m_(view.slant_range_m),
      sine_(std::sin(view.incidence_rad)),
      cosine_(std::cos(view.incidence_rad)),
      above_ground_m_(view.aim_m.y - height_m) {
  const auto angles = ground_angular_extent(view, height_m);
  if (!angles) return;
  const double first = std::tan(angles->first), last = std::tan(angles->second);
  if (!(first < last)) return;
  const double depth_first = plane_depth(first), depth_last = plane_depth(last);
  const double across_first = (slant_range_m_ + depth_first) * first, across_last = (slant_range_m_ + depth_last) * last;
  line_ = SliceLine{first, last, depth_first, across_first, depth_last - depth_first, across_last - across_first,
                    kGroundFace};
}

double SliceGround::plane_depth(double tangent) const {
  // The height above the ground, above_ground − cos θ · depth + sin θ · (r + depth) · tangent, is zero there.
  return (above_ground_m_ + slant_range_m_ * sine_ * tangent) / (cosine_ - sine_ * tangent);
}

double SliceGround::depth_at(double tangent) const {
  const bool above_horizon = cosine_ - sine_ * tangent <= 1e-9, behind_nadir = sine_ + cosine_ * tangent <= 0.0;
  return above_horizon || behind_nadir ? std::numeric_limits<double>::infinity() : plane_depth(tangent);
}

void SliceGround::cover(std::span<const VisiblePiece> pieces, std::span<const SliceLine> lines, std::uint32_t ground,
                        std::vector<VisiblePiece>& all) const {
  all.clear();
  const auto add_ground = [&](double first, double last) {
    if (!line_) return;
    first = std::max(first, line_->first);
    last = std::min(last, line_->last);
    if (first < last) all.push_back({first, last, ground});
  };
  const double r = slant_range_m_;
  double done = -std::numeric_limits<double>::infinity();
  for (const VisiblePiece& p : pieces) {
    add_ground(done, p.first);
    done = p.last;
    const SliceLine& line = lines[p.line];
    const glm::dvec2 at_first(line.depth_at(p.first, r), depth_at(p.first));
    const glm::dvec2 at_last(line.depth_at(p.last, r), depth_at(p.last));
    const double behind_first = at_first.x - at_first.y, behind_last = at_last.x - at_last.y;
    if (std::max(behind_first, behind_last) <= kCoplanar_m) {
      all.push_back(p);
    } else if (std::min(behind_first, behind_last) >= 0.0) {
      add_ground(p.first, p.last);
    } else if (std::isinf(behind_first) || std::isinf(behind_last)) {
      all.push_back(p);  // it reaches beyond the horizon, which no bin does
    } else {
      const double middle = crossing(p.first, p.last, std::abs(behind_first), std::abs(behind_last), r + at_first,
                                     r + at_last);
      if (behind_first > 0.0) {
        add_ground(p.first, middle);
        all.push_back({middle, p.last, p.line});
      } else {
        all.push_back({p.first, middle, p.line});
        add_ground(middle, p.last);
      }
    }
  }
  add_ground(done, std::numeric_limits<double>::infinity());
}

/// A flat opaque face as it scatters towards the radar of one view.
struct FaceLook {
  const Material* material = nullptr;
  const glm::dmat4* object_from_world = nullptr;  ///< of its texture
  bool two_sided = false;                         ///< thin shell
  glm::dvec3 normal{0.0};                         ///< unit vector: along h, along v, along k

  /// −n·d.
  double cosine(double tangent) const {
    return -(normal.z + tangent * normal.y) / std::sqrt(1.0 + tangent * tangent);
  }
  /// γ without texture (docs/method/equations.md, E3).
  double brightness(double tangent) const;
};

double FaceLook::brightness(double tangent) const {
  const double c = two_sided ? std::abs(cosine(tangent)) : cosine(tangent);
  if (!(c > 0.0)) return 0.0;
  const double p = material->exponent;
  return material->gamma0 * (p == 0.0 ? 1.0 : p == 1.0 ? c : std::pow(c, p));
}

glm::dvec3 along_radar(const glm::dvec3& world, const RadarFrame& frame) {
  return {glm::dot(world, frame.h), glm::dot(world, frame.v), glm::dot(world, frame.k)};
}

/// The face of a mesh; a face without area has a zero normal, which scatters nothing.
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

/// Largest departure from a straight line between range and angle (bins).
constexpr double kBinTolerance = 4e-7;
/// Largest product of the relative change of γ in a part and the number of bins that it spans. A uniform part puts an
/// eighth of that, in units of a bin's power, into the wrong one of two bins.
constexpr double kGammaTolerance = 4e-6;
/// Parts this narrow (m) across the rays are not divided: a part so narrow whose range is still not linear is seen edge-on.
constexpr double kNarrowest_m = 1e-6;
/// As for the surface engine: a face seen exactly edge-on has no finite slope, and no area either.
constexpr double kSteepest = 1e-6;
/// With more checker squares than this within one piece, only their mean counts, which is 1.
constexpr double kMostSquares = 20'000.0;

/// Deposits the power γ dδ that visible pieces of faces scatter into one row's range bins. Divides a piece at the
/// borders of checker squares, then until range and γ are so linear that no bin is wrong by a millionth.
class PieceDeposit {
 public:
  /// `width_m`: width of a slice along track. Over it, the range of a face at one ray angle changes with the slope of
  /// its plane.
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
  /// Stores in squares_, in order, the tangents at which the line passes from one square to the next, and both ends;
  /// false if the squares are too many to be resolved.
  bool find_squares(const FaceLook& look, const SliceLine& line, double along_m, double first, double last);

  const SliceFrame& frame_;
  double width_m_;
  std::span<double> bins_;
  std::vector<double> squares_;
};

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

struct Parts {
  std::vector<std::uint32_t> opaque, media;
};

Parts parts_of(const Scene& scene) {
  Parts parts;
  for (std::uint32_t t = 0; t < scene.mesh.triangles.size(); ++t) {
    const bool opaque = scene.materials[scene.mesh.material[t]].opaque;
    if (opaque) parts.opaque.push_back(t);
    if (!opaque && scene.pieces[scene.mesh.piece[t]].closed) parts.media.push_back(t);
  }
  return parts;
}

constexpr std::uint32_t kNoFace = 0xffffffffu;

/// Data common to all rows.
struct SectionView {
  SectionView(const Scene& s, const Acquisition& a, int n_slices_per_row)
      : scene(s),
        view(a),
        n_slices(n_slices_per_row),
        frame(a),
        vertices_m(radar_vertices(s, a)),
        parts(parts_of(s)),
        opaque(s, vertices_m, parts.opaque, a),
        media(s, vertices_m, parts.media, a) {
    if (s.ground) {
      ground.emplace(a, s.ground->height_m);
      ground_look = look_of_ground(s, frame.radar);
    }
  }

  double width_m() const { return view.azimuth_spacing_m / n_slices; }

  const Scene& scene;
  const Acquisition& view;
  int n_slices;
  SliceFrame frame;
  std::vector<glm::dvec3> vertices_m;
  Parts parts;
  SlicedFaces opaque, media;
  std::optional<SliceGround> ground;
  FaceLook ground_look;
};

/// Scratch of one thread.
class RowSections {
 public:
  explicit RowSections(const SectionView& v)
      : v_(v),
        envelope_(v.view.slant_range_m),
        media_(v.scene, v.frame, v.view),
        bins_(static_cast<std::size_t>(v.view.n_range)),
        deposit_(v.frame, v.width_m(), bins_) {}

  void render(int i, std::span<float> row, const Monitor& monitor) {
    std::fill(bins_.begin(), bins_.end(), 0.0);
    const double start_m = v_.view.row_offset_m(i - 0.5);
    for (int sub = 0; sub < v_.n_slices; ++sub) {
      if (sub % 16 == 0) monitor.check();
      add_slice(i, start_m + (sub + 0.5) * v_.width_m());
    }
    for (std::size_t j = 0; j < row.size(); ++j) {
      const double beta0_per_mass = v_.view.range_m(static_cast<double>(j)) / (v_.view.range_spacing_m * v_.n_slices);
      row[j] = static_cast<float>(bins_[j] * beta0_per_mass);
    }
  }

 private:
  void add_slice(int i, double along_m) {
    v_.opaque.cut(i, along_m, lines_);
    envelope_.find(lines_, pieces_);
    if (v_.ground) {
      const auto index = static_cast<std::uint32_t>(lines_.size());
      if (v_.ground->line()) lines_.push_back(*v_.ground->line());
      v_.ground->cover(pieces_, lines_, index, with_ground_);
      pieces_.swap(with_ground_);
    }
    v_.media.cut(i, along_m, media_lines_);
    media_.begin_slice(media_lines_);
    FaceLook look;
    std::uint32_t face = kNoFace;  // behind media a face comes in many parts
    media_.run(pieces_, lines_, bins_, [&](std::uint32_t n, double first, double last, double weight) {
      const SliceLine& line = lines_[n];
      if (line.face != face) {
        face = line.face;
        look = face == kGroundFace ? v_.ground_look : look_of_face(v_.scene, face, v_.frame.radar);
      }
      deposit_.add(look, line, along_m, first, last, weight);
    });
  }

  const SectionView& v_;
  LowerEnvelope envelope_;
  SliceMedia media_;
  std::vector<double> bins_;
  PieceDeposit deposit_;
  std::vector<SliceLine> lines_, media_lines_;
  std::vector<VisiblePiece> pieces_, with_ground_;
};

}  // namespace

Image<float> section_reference(const Scene& scene, const Acquisition& view, int n_slices_per_row,
                               const Monitor& monitor) {
  validate(view);
  if (n_slices_per_row < 1) {
    throw UsageError("a reference needs at least 1 slice per row; it was asked for " +
                     std::to_string(n_slices_per_row));
  }
  if (scene.ground && view.aim_m.y + view.altitude_m() <= scene.ground->height_m) {
    throw GeometryError("the radar stands below the ground: raise the altitude or check the ground's height");
  }
  const SectionView shared(scene, view, n_slices_per_row);
  Image<float> beta0(view.n_azimuth, view.n_range);
  std::vector<std::optional<RowSections>> workers(static_cast<std::size_t>(thread_count()));
  std::atomic<std::uint64_t> n_rows_done{0};
  const auto n_rows = static_cast<std::size_t>(view.n_azimuth);
  parallel_for(n_rows, 1, [&](std::size_t begin, std::size_t end, int worker) {
    auto& mine = workers[static_cast<std::size_t>(worker)];
    if (!mine) mine.emplace(shared);
    for (std::size_t i = begin; i < end; ++i) {
      monitor.check();
      mine->render(static_cast<int>(i), beta0.row(static_cast<int>(i)), monitor);
      const std::uint64_t done = ++n_rows_done;
      if (worker == 0) monitor.report("reference rows", done, n_rows);  // reports must not overlap
    }
  });
  return beta0;
}

}  // namespace sarnerf

// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/render/section_reference.h"

#include <atomic>
#include <optional>

#include "piece_deposit.h"
#include "sarnerf/core/error.h"
#include "sarnerf/core/parallel.h"
#include "slice_ground.h"
#include "slice_media.h"

namespace sarnerf {
namespace {

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

/// What rows share.
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

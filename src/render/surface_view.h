// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "ground_plane.h"
#include "layer_row.h"
#include "nested_images.h"
#include "reconstruct.h"
#include "row_slices.h"
#include "sarnerf/render/engine.h"
#include "surface_scene.h"
#include "triangle_section.h"
#include "view_rays.h"
#include "visible_extent.h"

namespace sarnerf {

/// Scratch of one worker that renders rows of a mesh.
struct SurfaceWorker {
  SliceBlock block;
  Slice bare;  ///< meets nothing but the ground
  MediaScratch media;
  std::vector<RowSlice> slices;    ///< of the row under way
  std::vector<SliceGroup> groups;  ///< what they stand for in coarser samplings
  std::vector<double> bins, ground_bins;
  std::optional<LayerRow> layers;
  std::uint64_t n_hits = 0;

  /// What coarser samplings of the row have gathered.
  struct Nested {
    std::vector<double> bins;
    SliceSubset subset;
    MediaScratch media;
  };
  std::vector<Nested> nested;  ///< one for each level
  std::vector<MediaSubset> media_subsets;
};

/// One view of a mesh, row by row; rows are independent.
class SurfaceView {
 public:
  /// `scene`, `plan` and `nested` must outlive it; the plan has at least one ray. `nested`, unless null, gets
  /// the coarser samplings.
  SurfaceView(const SurfaceScene& scene, const ViewPlan& plan, NestedImages* nested);

  SurfaceWorker make_worker() const;

  /// Writes row i of the image, of the layers that the plan asks for, and of the nested images.
  void render_row(int i, SurfaceWorker& w, RenderedView& out, const Monitor& monitor) const;

 private:
  void render_slices(std::size_t first, std::size_t n, SurfaceWorker& w) const;
  void render_kept(std::size_t s, const RayRange& kept, const RayRange& through_media, Slice& slice,
                   SurfaceWorker& w) const;
  void render_ground_around(std::size_t s, const RayRange& kept, const Slice& beside, SurfaceWorker& w) const;
  void deposit(std::size_t s, const Slice& slice, SurfaceWorker& w) const;
  void deposit_ground_outside(std::size_t s, double gap_first, double gap_last, SurfaceWorker& w) const;

  /// Calls f(k_step, group, the worker's scratch) for the coarser samplings that slice s of the row is part of.
  template <class F>
  void for_nested(std::size_t s, SurfaceWorker& w, F&& f) const {
    if (w.groups[s].n_slices == 0) return;
    for (std::size_t l = 0; l < w.nested.size(); ++l) f(NestedImages::k_step(l), w.groups[s], w.nested[l]);
  }

  const SurfaceScene& scene_;
  const ViewPlan& plan_;
  NestedImages* nested_;
  VisibleExtent extent_;
  ViewRays rays_;
  TriangleSections sections_;
  std::optional<GroundPlane> ground_;
  SliceScene slice_scene_;
  std::optional<VisibleExtent> media_extent_;
  std::optional<LayerView> layers_;
  std::span<const Component> components_;
  RowSlices row_slices_;
  std::vector<double> beta0_per_mass_;  ///< (r_j Δθ / Δr), averaged over the row's slices
};

}  // namespace sarnerf

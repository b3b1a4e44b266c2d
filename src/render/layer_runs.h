// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

#include "layer_row.h"
#include "slice.h"

namespace sarnerf {

/// Where layers go, and what they want to know of the triangles of a slice.
struct LayerSink {
  LayerRow* row = nullptr;  ///< null: no layers
  std::span<const Component> component;  ///< per triangle given to the tracer
};

/// One planar run of a slice, as the image gets it: samples [first, last], with `before` and `after` of a
/// ray step beyond them.
struct SliceRun {
  std::size_t first = 0, last = 0;
  double before = 0.0, after = 0.0;
  double mass = 0.0;
  double smear = 0.0;
};

/// Gives a run to the layers, in parts where triangles of different components lie in one plane. It hides
/// the reference plane even if it scatters nothing.
void add_run(const ViewRays& rays, const Slice& slice, const SliceRun& run, const LayerSink& sink);

}  // namespace sarnerf

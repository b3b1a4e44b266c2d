// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

#include "appearance.h"
#include "layer_runs.h"
#include "slice.h"
#include "triangle_section.h"

namespace sarnerf {

/// What reconstruction may ask about the surfaces it meets.
struct SliceScene {
  const ViewRays& rays;
  const TriangleSections& sections;
  const AppearanceTable& appearances;
  const Appearance* ground = nullptr;  ///< null without a ground
};

/// Deposits one slice into its row of range bins, in units of γ times ray steps.
///
/// Rays are samples of the piecewise planar curve in which the slice's plane cuts the scene. Between
/// two rays on one plane the curve is known; between rays on different planes it is mended: planes that
/// meet there meet at a corner (roof and wall, wall and ground); otherwise the nearer face ends where
/// its triangle does, and the farther one begins there. Each planar run is deposited as one trapezoid
/// over the ranges it spans, so the image has neither gaps nor aliases, and flat scenes need few rays.
///
/// Both end samples of the slice must be set: to nothing, or to the ground. Layers, if asked for, get every
/// run that the image gets, and those that scatter nothing.
void deposit_slice(const Slice& slice, const SliceScene& scene, std::span<double> bins,
                   const LayerSink& layers = {});

}  // namespace sarnerf

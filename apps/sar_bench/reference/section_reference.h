// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sarnerf/core/image.h"
#include "sarnerf/core/parallel.h"
#include "sarnerf/geometry/acquisition.h"
#include "sarnerf/scene/scene.h"

namespace sarnerf {

/// β⁰ of a mesh, [n_azimuth × n_range], to measure the errors of engines against: no rays, no acceleration structure,
/// no single precision before the image itself.
///
/// A row is the mean of n_slices_per_row slices, the planes perpendicular to the track at the centres of equal parts
/// of the row's width. A slice's plane contains all of its rays and cuts every face in a line. So the face that each
/// ray angle sees first is known exactly, and its power γ dδ is spread over exactly the ranges that it spans:
///
///     β⁰_ij = (r_j / Δr) · mean over slices of ∫ γ dδ over the angles whose range lies in bin j
///
/// (printed eq. 24 in the limit of infinitely many elevation rays; docs/method/equations.md, E1 for media, E3 for γ.)
/// For opaque material, the number of slices is the only sampling: elevation is exact to a millionth of a bin's
/// power, and the error of outlines and textures between slices falls as 1/n or faster (compare n with 2n). An engine
/// with as many slices has them at the same positions. Translucent solids are integrated ray by ray, 32 rays to a
/// pixel or more. Ground, thin shells and textures as in the surface engine; checkers with more than 20,000 squares
/// across a face in a slice count as their mean.
///
/// Throws UsageError for less than one slice, GeometryError for an impossible view. Cost: 128 slices for each of 128
/// rows take a box 0.2 s, a mesh of 70,000 triangles 1 s, on two threads; media some seconds.
Image<float> section_reference(const Scene& scene, const Acquisition& view, int n_slices_per_row,
                               const Monitor& monitor = {});

}  // namespace sarnerf

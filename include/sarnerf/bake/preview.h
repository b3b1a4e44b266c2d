// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sarnerf/bake/surface_mesh.h"
#include "sarnerf/core/image.h"
#include "sarnerf/dataset/colour_picture.h"

namespace sarnerf {

struct PreviewOptions {
  int width = 1200;                ///< pixels, at least 200
  int height = 900;                ///< pixels, at least 200
  double azimuth_rad = 0.5236;     ///< of the oblique view: 0 looks from +Z, growing towards +X, as a radar's; 30°
  double elevation_rad = 0.6109;   ///< of the oblique view, above the horizon; 35°
};

/// One picture of a surface on white ground: at the left an oblique view, at the right from top to bottom the surface
/// from above (X to the right, Z down), from the front (from +Z: X to the right, Y up) and from the side (from +X: −Z
/// to the right, Y up). All four are orthographic and say what they show; the three share one scale and a scale bar of
/// 1, 2 or 5 × 10ⁿ metres, and small arrows name the axes, red for X, green for Y, blue for Z. Facets are shaded by
/// how they lean towards a light behind the viewer's left shoulder, over an even light from all around, and
/// grow paler with depth. What is seen from behind, which a closed surface does not show, is red.
///
/// Row i is the picture's line from the top, column j its pixel from the left. 2 × 2 rays a pixel, one surface each, by
/// RayTracer in float32 relative to the surface's middle. An empty mesh gives a white picture. Throws UsageError for
/// fewer pixels than 200 a side, more than 16384, or an angle that is not finite. Cost: 0.5 s at 1200 × 900 on one
/// thread, and Embree's tree of the triangles.
Image<Colour> preview(const SurfaceMesh& mesh, const PreviewOptions& options = {});

}  // namespace sarnerf

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace sarnerf {

/// The bytes of an opaque 8-bit RGB PNG of an SVG document on white, `scale` pixels for each of the
/// document's own. The same bytes for the same document, fonts and version of librsvg; nothing outside of
/// the document is loaded. Throws UsageError for a scale that is not positive or gives a picture of more
/// than 32,767 pixels a side or 256 million pixels, InputError for text that is no SVG document or has no
/// size in pixels, and Error when it cannot be drawn. About 4 bytes a pixel.
std::vector<std::byte> png_of_svg(const std::string& svg, double scale = 1.0);

}  // namespace sarnerf

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sarnerf/core/image.h"
#include "sarnerf/dataset/colour_picture.h"

namespace sarnerf {

/// Values as colours by sign: light grey at zero, over sky blue to dark blue at −limit, over orange to dark brown
/// at +limit, both sides equally dark at equal magnitude and told apart by the colour-blind, too. Clamped beyond.
/// What is not finite is black; a limit that is not positive makes everything finite grey.
Image<Colour> signed_colours(const Image<float>& values, float limit);

}  // namespace sarnerf

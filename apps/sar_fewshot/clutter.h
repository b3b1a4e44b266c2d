// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "chips.h"
#include "sarnerf/recognise/cell.h"

/// The background of chips: taken from them, exchanged between them, and compared.
namespace sarnerf::app {

/// The background of a chip over its mean, everywhere: where its target and its shadow are, it is that of the chip's edge.
Image<float> relative_background(const Image<float>& power);

/// The target and the shadow of a chip, with 8 pixels around them, on clutter of mean 1 and the same size, which is made as bright as the chip's
/// background. A chip in which no region is found, as on a ground without power, is returned as it is.
Image<float> on_clutter(const Image<float>& power, const Image<float>& clutter);

/// The test chips of a draw; if the options ask for them, with targets and shadows also on the backgrounds of other test chips: of the same class
/// and nearly the same azimuth (a control: whatever this costs is the exchange's own fault), and of other classes. Targets and shadows are
/// regions of find_regions() around the centre, and 8 pixels more.
TestChips test_of_classes(const std::vector<ClassChips>& chips, const Draw& draw, const Options& options);

/// Correlation of the background of test chips with that of training chips, by class and distance in azimuth; in Markdown.
std::string ground_text(const std::vector<ClassChips>& chips, const Monitor& monitor);

/// Statistics of the background (outside of target and shadow, and 8 pixels around them: faint returns of a vehicle are no clutter) of measured
/// chips and of learned ones at the same azimuths, and how often a network can tell them apart;
/// in Markdown. Of the first draw with the most shots. The corners of a learned view are those of a shot, mirrored: what is asked is whether
/// that shows, not whether clutter under a shot's target was filled in well.
std::string clutter_text(const Options& options, const std::vector<ClassChips>& chips, const Monitor& monitor);

}  // namespace sarnerf::app

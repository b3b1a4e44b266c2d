// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "recipe.h"
#include "sarnerf/render/layers.h"

namespace sarnerf::app {

/// Endings of the files that these layers become, with their dot: ".wall.tif", ".mask.png", …
std::vector<std::string> layer_endings(const LayerSet& layers);

/// A file beside the image.
struct LayerFile {
  std::string ending;  ///< replaces the image's
  std::vector<std::byte> bytes;
};

/// Encodes the layers of a view, in the order of layer_endings(): each as TIFF (float32; the mask bytes),
/// and pictures of the components (wall red, roof green, ground blue, other grey; decibels below the
/// `white`), the mask (over `image`, the mean one of their calibration), incidence (0 to 90 degrees), elevation and scatterers.
std::vector<LayerFile> encode_layers(const Layers& layers, const Image<float>& image, float white);

/// Names of the layers, for recipes.
Json layers_request(const LayerSet& layers);

/// For --explain; empty without layers.
std::string layers_line(const LayerSet& layers);

}  // namespace sarnerf::app

// SPDX-License-Identifier: Apache-2.0
#include "layer_files.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>

#include "sarnerf/dataset/colour_picture.h"
#include "sarnerf/dataset/display.h"
#include "sarnerf/dataset/image_file.h"

namespace sarnerf::app {
namespace {

std::vector<Layer> listed(const LayerSet& layers) {
  std::vector<Layer> list;
  for (std::size_t n = 0; n < kNumberOfLayers; ++n) {
    if (layers.has(static_cast<Layer>(n))) list.push_back(static_cast<Layer>(n));
  }
  return list;
}

bool is_component(Layer layer) { return static_cast<std::size_t>(layer) < kNumberOfComponents; }

bool any_component(const LayerSet& layers) {
  const auto list = listed(layers);
  return std::any_of(list.begin(), list.end(), is_component);
}

/// Wall red, roof green, ground blue, other grey, on one scale of decibels.
Image<Colour> colour_of_components(const Layers& layers, const Image<float>& image, float white) {
  Image<Colour> picture(image.n_azimuth(), image.n_range());
  const auto paint = [&](Layer layer, const Colour& with) {
    if (!layers.set.has(layer)) return;
    const Image<std::uint8_t> levels = display_levels(layers.values(layer), Quantity::power, white);
    for (std::size_t n = 0; n < picture.pixels().size(); ++n) {
      for (std::size_t c = 0; c < 3; ++c) {
        std::uint8_t& out = picture.pixels()[n][c];
        out = std::max(out, static_cast<std::uint8_t>(levels.pixels()[n] * with[c] / 255));
      }
    }
  };
  paint(Layer::ground, {90, 140, 255});
  paint(Layer::roof, {70, 220, 90});
  paint(Layer::wall, {255, 80, 60});
  paint(Layer::other, {210, 210, 210});
  return picture;
}

/// Shadow blue, layover orange, both magenta, over the image at half its brightness.
Image<Colour> colour_of_mask(const Layers& layers, const Image<float>& image, float white) {
  constexpr std::array<Colour, 4> kColours{{{255, 255, 255}, {40, 90, 220}, {255, 150, 20}, {220, 40, 200}}};
  const Image<std::uint8_t> levels = display_levels(image, Quantity::power, white);
  Image<Colour> picture(image.n_azimuth(), image.n_range());
  for (std::size_t n = 0; n < picture.pixels().size(); ++n) {
    const std::uint8_t value = layers.mask.pixels()[n];
    const int lift = value == 0 ? 0 : 110;  // so that shadow is not black
    for (std::size_t c = 0; c < 3; ++c) {
      picture.pixels()[n][c] = static_cast<std::uint8_t>((lift + levels.pixels()[n] * (255 - lift) / 510) *
                                                         kColours[value][c] / 255);
    }
  }
  return picture;
}

/// Largest finite value, at least `least`.
float largest(const Image<float>& image, float least) {
  float most = least;
  for (const float v : image.pixels()) most = std::isfinite(v) ? std::max(most, v) : most;
  return most;
}

Image<Colour> colour_of_values(Layer layer, const Image<float>& values) {
  if (layer == Layer::incidence) return colour_map(values, 0.0f, 90.0f);
  return colour_map(values, 0.0f, largest(values, layer == Layer::scatterers ? 3.0f : 1e-3f));
}

}  // namespace

std::vector<std::string> layer_endings(const LayerSet& layers) {
  std::vector<std::string> endings;
  for (const Layer layer : listed(layers)) {
    const std::string stem = "." + std::string(name(layer));
    endings.push_back(stem + ".tif");
    if (!is_component(layer)) endings.push_back(stem + ".png");
  }
  if (any_component(layers)) endings.push_back(".components.png");
  return endings;
}

std::vector<LayerFile> encode_layers(const Layers& layers, const Image<float>& image, float white) {
  std::vector<LayerFile> files;
  for (const Layer layer : listed(layers.set)) {
    const std::string stem = "." + std::string(name(layer));
    if (layer == Layer::mask) {
      files.push_back({stem + ".tif", encode_tiff(layers.mask)});
      files.push_back({stem + ".png", encode_png(colour_of_mask(layers, image, white))});
      continue;
    }
    files.push_back({stem + ".tif", encode_tiff(layers.values(layer))});
    if (layer == Layer::error) {
      // On the image's scale of decibels, ten lower: errors are seldom as bright as what they belong to.
      files.push_back({stem + ".png", encode_png(display_levels(layers.error, Quantity::power, 0.1f * white))});
      continue;
    }
    if (!is_component(layer)) {
      files.push_back({stem + ".png", encode_png(colour_of_values(layer, layers.values(layer)))});
    }
  }
  if (any_component(layers.set)) {
    files.push_back({".components.png", encode_png(colour_of_components(layers, image, white))});
  }
  return files;
}

Json layers_request(const LayerSet& layers) {
  Json names = Json::array();
  for (const Layer layer : listed(layers)) names.push_back(name(layer));
  return names;
}

std::string layers_line(const LayerSet& layers) {
  std::string line;
  for (const Layer layer : listed(layers)) line += (line.empty() ? "" : ", ") + std::string(name(layer));
  return line;
}

}  // namespace sarnerf::app

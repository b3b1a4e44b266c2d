// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <bitset>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "sarnerf/core/image.h"
#include "sarnerf/scene/scene.h"

namespace sarnerf {

/// Images that a render can produce beside β⁰, pixel by pixel (docs/guide/layers.md).
enum class Layer : std::uint8_t {
  ground,      ///< β⁰ of the ground alone; linear power
  wall,        ///< β⁰ of walls
  roof,        ///< β⁰ of roofs
  other,       ///< β⁰ of everything else; the four add up to the image
  mask,        ///< shadow and layover, a MaskValue
  incidence,   ///< degrees between ray and surface normal, mean weighted by brightness
  elevation,   ///< metres above the reference plane, mean weighted by brightness
  scatterers,  ///< separate scatterers in the pixel, mean over its slices
  error,       ///< expected |β⁰ − β⁰*| of the image itself (error_estimate.h)
};
inline constexpr std::size_t kNumberOfLayers = 9;
inline constexpr std::size_t kNumberOfComponents = 4;  ///< ground, wall, roof, other

/// Values of Layer::mask, numbered as in isce3.
enum class MaskValue : std::uint8_t { none = 0, shadow = 1, layover = 2, both = 3 };

/// "ground" … "error".
std::string_view name(Layer layer);

/// A set of layers.
class LayerSet {
 public:
  bool has(Layer layer) const { return bits_.test(static_cast<std::size_t>(layer)); }
  void add(Layer layer) { bits_.set(static_cast<std::size_t>(layer)); }
  bool empty() const { return bits_.none(); }
  /// This set without one layer.
  LayerSet without(Layer layer) const {
    LayerSet rest = *this;
    rest.bits_.reset(static_cast<std::size_t>(layer));
    return rest;
  }
  bool operator==(const LayerSet&) const = default;

 private:
  std::bitset<kNumberOfLayers> bits_;
};

LayerSet all_layers();

/// "all", "none", or names separated by commas: "wall,roof,mask". Throws UsageError for other words.
LayerSet layers_from_text(std::string_view text);

/// Which layers a view should have.
struct LayerRequest {
  LayerSet layers;
  double reference_height_m = 0.0;  ///< world height of the plane that mask and elevation refer to
};

/// The layers of one view; those that were not asked for are empty images.
struct Layers {
  LayerSet set;
  std::array<Image<float>, kNumberOfComponents> beta0;  ///< indexed by Component − 1
  Image<std::uint8_t> mask;
  Image<float> incidence_deg;  ///< NaN where no surface scatters
  Image<float> elevation_m;    ///< NaN where nothing scatters
  Image<float> scatterers;
  Image<float> error;  ///< NaN where it is not known

  /// Allocates the images of `layers`, with the values of a view in which nothing scatters.
  Layers(const LayerSet& layers, int n_azimuth, int n_range);
  Layers() = default;

  /// The image of a float layer. Throws UsageError for the mask.
  Image<float>& values(Layer layer);
  const Image<float>& values(Layer layer) const;
};

/// Bytes per pixel of these layers.
std::uint64_t bytes_per_pixel(const LayerSet& layers);

}  // namespace sarnerf

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "job.h"
#include "display_scale.h"
#include "layer_files.h"

namespace sarnerf::app {

/// How a view was sampled, and what error it says that it has.
struct ViewSampling {
  int n_elevation = 0, n_sub_rows = 0;
  std::size_t n_renders = 1;
  double error = ErrorEstimate::kUnknown;  ///< E of the mean image, before speckle and noise
};

/// What one rendered view becomes, ready to be written.
struct Products {
  Image<float> image;           ///< of the calibration and quantity asked for
  std::vector<std::byte> tiff;  ///< the same as a float32 file
  Layers layers;                ///< those asked for, calibrated, linear power
  Image<float> mean_image;      ///< that they add up to; empty without layers
  std::uint64_t n_hits = 0;
  ViewSampling sampling;        ///< as rendered, which --error may have made finer than planned
  double trace_and_deposit_s = 0.0;
  double formation_s = 0.0;
  double encode_s = 0.0;
  std::vector<std::string> warnings;
};

/// Renders a view of the job and encodes it. Throws NumericsError when a pixel is not finite.
Products make_products(const Job& job, std::size_t view, const Monitor& monitor);

/// The files of the products' layers; their pictures have the scale of the image's.
std::vector<LayerFile> layer_files(const Products& products, const Options& options, const DisplayScale& scale);

}  // namespace sarnerf::app

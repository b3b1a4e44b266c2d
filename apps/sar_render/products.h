// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "job.h"
#include "options.h"
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
/// and pictures of the components (wall red, roof green, ground blue, other grey; in decibels below
/// `white`), the mask (over `image`, the mean image in the layers' calibration), incidence (0 to 90 degrees),
/// elevation, scatterers and error.
std::vector<LayerFile> encode_layers(const Layers& layers, const Image<float>& image, float white);

/// Names of the layers, for recipes.
Json layers_request(const LayerSet& layers);

/// The layers' names for --explain; empty without layers.
std::string layers_line(const LayerSet& layers);

/// The sampling of a view, and its estimated error.
struct ViewSampling {
  int n_elevation = 0, n_slices = 0;
  std::size_t n_renders = 1;
  double error = ErrorEstimate::kUnknown;  ///< E of the mean image, before speckle and noise
};

/// One rendered view, ready to be written.
struct Products {
  Image<float> image;           ///< in the calibration and quantity requested
  std::vector<std::byte> tiff;  ///< the same as a float32 file
  Layers layers;                ///< those requested, calibrated, linear power
  Image<float> mean_image;      ///< image that the layers add up to; empty without layers
  std::uint64_t n_hits = 0;
  ViewSampling sampling;        ///< as rendered, which --error may have made finer than planned
  double trace_and_deposit_s = 0.0;
  double formation_s = 0.0;
  double encode_s = 0.0;
  std::vector<std::string> warnings;
};

/// Renders a view of the job and encodes it. Throws NumericsError when a pixel is not finite.
Products make_products(const Job& job, std::size_t view, const Monitor& monitor);

/// The files of the products' layers; their pictures have the same scale as the image's picture.
std::vector<LayerFile> layer_files(const Products& products, const Options& options, const DisplayScale& scale);

/// Cost of a run of the program: the only output that depends on clock and threads.
struct RunFigures {
  std::size_t n_rendered = 0;
  std::size_t n_reused = 0;  ///< views finished by an earlier run
  std::uint64_t n_hits = 0;
  std::vector<double> errors;        ///< estimates, of each rendered view that has one
  std::size_t n_unknown_errors = 0;  ///< rendered views without an estimate
  std::size_t n_repeated = 0;        ///< renders beyond one a view, for --error
  double trace_and_deposit_s = 0.0;  ///< summed over views
  double formation_s = 0.0;
  double encode_s = 0.0;
  double write_s = 0.0;
  double total_s = 0.0;  ///< wall clock of the whole program so far
};

/// Adds the figures of one view.
void add(const Products& products, RunFigures& figures);

/// "error about 0.66 %": the estimates of all rendered views, and how many views have none; empty before any is rendered.
std::string error_line(const RunFigures& figures);

/// The figures in one line of text.
std::string summary(const RunFigures& figures);

/// The report as JSON.
std::string report_text(const Job& job, const RunFigures& figures);

}  // namespace sarnerf::app

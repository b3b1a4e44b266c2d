// SPDX-License-Identifier: Apache-2.0
#include "products.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "formation.h"
#include "sarnerf/core/error.h"
#include "sarnerf/core/inner_image.h"
#include "sarnerf/dataset/image_file.h"
#include "sarnerf/render/framing.h"

namespace sarnerf::app {
namespace {

void require_finite(const Image<float>& image, const DatasetView& view) {
  for (std::size_t n = 0; n < image.pixels().size(); ++n) {
    if (std::isfinite(image.pixels()[n])) continue;
    const auto width = static_cast<std::size_t>(image.n_range());
    char text[200];
    std::snprintf(text, sizeof text,
                  "the pixel in row %zu, bin %zu of the view at incidence %.6g, azimuth %.6g deg is not "
                  "finite; check the materials for extreme values",
                  n / width, n % width, view.incidence_deg, view.azimuth_deg);
    throw NumericsError(text);
  }
}

/// Brings the layers to the image's size and calibration. They stay linear power.
void prepare_layers(Layers& layers, const Job& job, const Acquisition& acquisition) {
  for (std::size_t n = 0; n < kNumberOfLayers; ++n) {
    const auto layer = static_cast<Layer>(n);
    if (layer == Layer::mask || !layers.set.has(layer)) continue;
    layers.values(layer) = without_border(std::move(layers.values(layer)), job.border);
    if (n < kNumberOfComponents || layer == Layer::error) {
      calibrate(layers.values(layer), acquisition, job.reference_height_m, job.options.calibration);
    }
  }
  if (layers.set.has(Layer::mask)) layers.mask = without_border(std::move(layers.mask), job.border);
}

/// Renders view n, to the tolerance if there is one.
TolerantView render(const Job& job, std::size_t n, const Monitor& monitor) {
  const ViewPlan& plan = job.plans[n];
  if (!job.options.tolerance) return {job.built.engine->render(plan, monitor), plan, true, {}};
  // The pilot of the first view may have been good enough; it has no layers.
  if (n == 0 && job.tolerance->met && plan.layers.layers.empty()) return *job.tolerance->met;
  return render_to_tolerance(*job.built.engine, plan, *job.options.tolerance, monitor);
}

}  // namespace

Products make_products(const Job& job, std::size_t n, const Monitor& monitor) {
  TolerantView tolerant = render(job, n, monitor);
  const ViewPlan& plan = tolerant.plan;
  RenderedView& rendered = tolerant.view;
  monitor.check();
  Products products;
  products.sampling = {plan.fan.n_elevation, plan.n_sub_rows, std::max<std::size_t>(1, tolerant.steps.size()),
                       rendered.error.relative};
  products.n_hits = rendered.n_hits;
  products.trace_and_deposit_s = rendered.trace_and_deposit_s;
  products.warnings = std::move(rendered.warnings);
  const Acquisition acquisition = acquisition_of(job.views[n], job.aim_m);
  // Where the error is not known, the engine has said so.
  if (!tolerant.met && !std::isnan(rendered.error.relative)) {
    char text[160];
    std::snprintf(text, sizeof text, "the error is about %.2g %% after %zu renders, above the %.2g %% of --error",
                  100.0 * rendered.error.relative, tolerant.steps.size(), 100.0 * *job.options.tolerance);
    products.warnings.push_back(text);
  }
  // A blank image's explanation speaks of the swath already.
  const std::string outside = outside_swath_warning(*job.scene, acquisition);
  const bool said = std::any_of(products.warnings.begin(), products.warnings.end(), [&](const std::string& w) {
    return w.find(outside) != std::string::npos;
  });
  if (!outside.empty() && !said) products.warnings.push_back(outside);

  Image<float>& image = rendered.beta0;
  // Layers are those of the mean image, before any formation.
  Image<float> mean_image;
  if (!job.options.layers.empty()) mean_image = without_border(image, job.border);
  if (job.options.formation.any()) {
    const Stopwatch forming;
    require_finite(image, job.views[n]);
    const int n_without_noise = form_image(image, job.options.formation, plan.acquisition,
                                           job.reference_height_m, monitor) - job.border.range;
    image = without_border(std::move(image), job.border);
    if (n_without_noise > 0) {
      products.warnings.push_back((n_without_noise == 1 ? "the nearest range bin lies" : "the nearest " + std::to_string(n_without_noise) + " range bins lie") +
                                  " above the reference plane's nadir, where sigma0 and with "
                                  "it the noise level do not exist: no noise is there");
    }
    products.formation_s = forming.seconds();
  }

  if (!job.options.layers.empty()) {
    products.layers = std::move(rendered.layers);
    prepare_layers(products.layers, job, acquisition);
    calibrate(mean_image, acquisition, job.reference_height_m, job.options.calibration);
    products.mean_image = std::move(mean_image);
  }
  const Stopwatch encoding;
  const int n_bins = calibrate(image, acquisition, job.reference_height_m, job.options.calibration);
  if (n_bins > 0) {
    products.warnings.push_back((n_bins == 1 ? "the nearest range bin lies" : "the nearest " + std::to_string(n_bins) + " range bins lie") +
                                " above the reference plane's nadir, where " +
                                std::string(name(job.options.calibration)) +
                                " does not exist: zero stands there");
  }
  if (job.options.quantity == Quantity::amplitude) take_amplitude(image);
  require_finite(image, job.views[n]);
  products.tiff = encode_tiff(image);
  products.image = std::move(image);
  products.encode_s = encoding.seconds();
  return products;
}

std::vector<LayerFile> layer_files(const Products& products, const Options& options, const DisplayScale& scale) {
  if (products.layers.set.empty()) return {};
  const float white = scale.white_for(products.image);
  return encode_layers(products.layers, products.mean_image,
                       options.quantity == Quantity::amplitude ? white * white : white);
}

}  // namespace sarnerf::app

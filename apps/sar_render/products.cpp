// SPDX-License-Identifier: Apache-2.0
#include "products.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include <nlohmann/json.hpp>

#include "job.h"
#include "sarnerf/core/error.h"
#include "sarnerf/core/image.h"
#include "sarnerf/dataset/image_file.h"
#include "sarnerf/render/framing.h"

namespace sarnerf::app {

namespace {

ImpulseResponse response_of(const Options& o) {
  return impulse_response(o.formation, o.spacing_m.first, o.spacing_m.second);
}

}  // namespace

Border border_of(const Options& o) {
  if (!o.formation.resolution_m) return {};
  return border_of(response_of(o), o.size->first, o.size->second);
}

Json formation_request(const ImageFormation& f) {
  Json j;
  if (f.resolution_m) {
    j["resolution_m"] = {f.resolution_m->first, f.resolution_m->second};
    j["window"] = text_of(f.window);
  }
  if (f.speckle()) j["looks"] = f.looks;
  if (f.nesz_db) j["nesz_db"] = *f.nesz_db;
  if (f.speckle()) j["seed"] = f.seed;
  return j;
}

Json formation_resolved(const Options& o, const Border& border) {
  const ImpulseResponse response = response_of(o);
  const Taper taper(o.formation.window);
  return {{"bandwidth_per_m", {response.azimuth.bandwidth_per_m, response.range.bandwidth_per_m}},
          {"broadening", taper.broadening()},
          {"peak_sidelobe_db", taper.peak_sidelobe_db()},
          {"reach_pixels", {response.azimuth.reach(), response.range.reach()}},
          {"border_pixels", {border.azimuth, border.range}}};
}

std::vector<std::string> formation_lines(const Options& o, const Border& border) {
  const ImageFormation& f = o.formation;
  std::vector<std::string> lines;
  char text[320];
  if (f.resolution_m) {
    const ImpulseResponse response = response_of(o);
    const Taper taper(f.window);
    std::snprintf(text, sizeof text, "resolution %.6g x %.6g m (azimuth x range), window %s: highest sidelobe %.1f dB",
                  f.resolution_m->first, f.resolution_m->second, text_of(f.window).c_str(),
                  taper.peak_sidelobe_db());
    lines.push_back(text);
    std::snprintf(text, sizeof text,
                  "band %.4g x %.4g cycles/m, %.3g x %.3g of what the spacing holds; taps to %d x %d pixels",
                  response.azimuth.bandwidth_per_m, response.range.bandwidth_per_m,
                  response.azimuth.bandwidth_per_m * o.spacing_m.first,
                  response.range.bandwidth_per_m * o.spacing_m.second, response.azimuth.reach(),
                  response.range.reach());
    lines.push_back(text);
    std::snprintf(text, sizeof text,
                  "%d x %d pixels more are rendered on every side, for what leaks in from there, and cut off",
                  border.azimuth, border.range);
    lines.push_back(text);
  }
  if (f.speckle()) {
    std::snprintf(text, sizeof text, "speckle of %.6g look%s of the full resolution, %s; seed %llu", f.looks,
                  f.looks == 1.0 ? "" : "s",
                  f.resolution_m ? "correlated by the impulse response" : "independent from pixel to pixel",
                  static_cast<unsigned long long>(f.seed));
    lines.push_back(text);
  }
  if (f.nesz_db) {
    std::snprintf(text, sizeof text, "noise of %.6g dB in sigma0, %s", *f.nesz_db,
                  f.speckle() ? "speckle of its own" : "its mean is added");
    lines.push_back(text);
  }
  return lines;
}

std::string formation_left_out(const ImageFormation& f) {
  std::string unused;
  const auto add = [&](bool used, const char* what) {
    if (!used) unused += (unused.empty() ? "" : ", ") + std::string(what);
  };
  add(f.resolution_m.has_value(), "impulse response");
  add(f.speckle(), "speckle");
  add(f.nesz_db.has_value(), "noise");
  return unused.empty() ? unused : unused + ": not asked for";
}

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
      // On the image's scale of decibels, lowered by 10 dB: an error is seldom as bright as its pixel.
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

namespace {

void require_finite(const Image<float>& image, const ViewAngles& view) {
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
  // The pilot of the first view may meet the tolerance already; it has no layers.
  if (n == 0 && job.tolerance->met && plan.layers.layers.empty()) return *job.tolerance->met;
  return render_to_tolerance(*job.built.engine, plan, *job.options.tolerance, monitor);
}

/// "the nearest range bin lies", "the nearest 3 range bins lie".
std::string nearest_bins_lie(int n_bins) {
  return n_bins == 1 ? "the nearest range bin lies" : "the nearest " + std::to_string(n_bins) + " range bins lie";
}

}  // namespace

Products make_products(const Job& job, std::size_t n, const Monitor& monitor) {
  TolerantView tolerant = render(job, n, monitor);
  const ViewPlan& plan = tolerant.plan;
  RenderedView& rendered = tolerant.view;
  monitor.check();
  Products products;
  products.sampling = {plan.fan.n_elevation, plan.n_slices, std::max<std::size_t>(1, tolerant.steps.size()),
                       rendered.error.relative};
  products.n_hits = rendered.n_hits;
  products.trace_and_deposit_s = rendered.trace_and_deposit_s;
  products.warnings = std::move(rendered.warnings);
  const Acquisition& acquisition = job.views[n];
  // If the error is not known, the engine has warned of it.
  if (!tolerant.met && !std::isnan(rendered.error.relative)) {
    char text[160];
    std::snprintf(text, sizeof text, "the error is about %.2g %% after %zu renders, above the %.2g %% of --error",
                  100.0 * rendered.error.relative, tolerant.steps.size(), 100.0 * *job.options.tolerance);
    products.warnings.push_back(text);
  }
  // The warning of a blank image ends with that of the swath: of the swath that was rendered, wider by the border.
  if (const std::string outside = outside_swath_warning(*job.scene, acquisition); !outside.empty()) {
    const auto blank = std::ranges::find_if(products.warnings, [](const std::string& w) {
      return w.starts_with("the image is blank") && w.find("the scene lies") != std::string::npos;
    });
    if (blank == products.warnings.end()) {
      products.warnings.push_back(outside);
    } else {
      blank->replace(blank->find("the scene lies"), std::string::npos, outside);
    }
  }

  Image<float>& image = rendered.beta0;
  // Layers are those of the mean image, before any formation.
  Image<float> mean_image;
  if (!job.options.layers.empty()) mean_image = without_border(image, job.border);
  if (job.options.formation.any()) {
    const Stopwatch forming;
    require_finite(image, angles_of(job, n));
    const int n_without_noise = form_image(image, job.options.formation, plan.acquisition,
                                           job.reference_height_m, monitor) - job.border.range;
    image = without_border(std::move(image), job.border);
    if (n_without_noise > 0) {
      products.warnings.push_back(nearest_bins_lie(n_without_noise) +
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
    products.warnings.push_back(nearest_bins_lie(n_bins) +
                                " above the reference plane's nadir, where " +
                                std::string(name(job.options.calibration)) +
                                " does not exist: its bins are 0");
  }
  if (job.options.quantity == Quantity::amplitude) take_amplitude(image);
  require_finite(image, angles_of(job, n));
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

// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/render/image_formation.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "sarnerf/core/convolve_power.h"
#include "sarnerf/core/error.h"
#include "sarnerf/core/format.h"
#include "speckle.h"

namespace sarnerf {
namespace {

constexpr double kMostLooks = 1000.0;
constexpr double kMostNoiseDb = 300.0;

/// N_j of every bin, 0 where no incidence exists.
std::vector<double> noise_power(double nesz_db, const Acquisition& acquisition, double reference_height_m) {
  const double height_m = acquisition.altitude_m() + acquisition.aim_m.y - reference_height_m;
  if (!(height_m > 0.0)) {
    throw GeometryError("a noise level in sigma0 needs a radar above the reference plane; it stands " +
                        format("%.6g", -height_m) +
                        " m below it: raise the altitude or lower --ground-height");
  }
  const double nesz = std::pow(10.0, nesz_db / 10.0);
  std::vector<double> power(static_cast<std::size_t>(acquisition.n_range), 0.0);
  for (int j = 0; j < acquisition.n_range; ++j) {
    const double cosine = height_m / acquisition.range_m(j);
    if (cosine >= 1.0) continue;
    power[static_cast<std::size_t>(j)] = nesz / std::sqrt((1.0 - cosine) * (1.0 + cosine));
  }
  return power;
}

/// All of validate() but the sampling, which making the kernels finds out.
void require_meaning(const ImageFormation& f) {
  if (!(f.looks >= 1.0) || (f.looks > kMostLooks && f.speckle())) {
    throw UsageError("--looks: expected a number from 1 to 1000, or inf for no speckle, found " +
                     format("%.6g", f.looks));
  }
  if (f.nesz_db && !(std::abs(*f.nesz_db) <= kMostNoiseDb)) {
    throw UsageError("--nesz: expected decibels between -300 and 300, found " +
                     format("%.6g", *f.nesz_db));
  }
  if (!f.resolution_m && f.window != Window{}) {
    throw UsageError("--window: a window shapes an impulse response: give its --resolution too, or leave the window " +
                     text_of(f.window) + " out");
  }
}

}  // namespace

void validate(const ImageFormation& formation, double azimuth_spacing_m, double range_spacing_m) {
  require_meaning(formation);
  impulse_response(formation, azimuth_spacing_m, range_spacing_m);
}

ImpulseResponse impulse_response(const ImageFormation& f, double azimuth_spacing_m, double range_spacing_m) {
  if (!f.resolution_m) return {};
  return impulse_response(Resolution{f.resolution_m->first, f.resolution_m->second, f.window}, azimuth_spacing_m,
                          range_spacing_m);
}

std::vector<double> look_weights(double looks) {
  const auto n_looks = static_cast<std::size_t>(std::ceil(looks));
  if (double(n_looks) == looks) return std::vector<double>(n_looks, 1.0 / looks);
  // k equal weights a and a last one b: k a + b = 1 and k a² + b² = 1 / looks.
  const double k = double(n_looks) - 1.0;
  const double b = (1.0 - std::sqrt(1.0 - (k + 1.0) * (1.0 - k / looks))) / (k + 1.0);
  std::vector<double> weights(n_looks, (1.0 - b) / k);
  weights.back() = b;
  return weights;
}

int form_image(Image<float>& beta0, const ImageFormation& formation, const Acquisition& acquisition,
               double reference_height_m, const Monitor& monitor) {
  if (!formation.any()) return 0;
  if (beta0.n_azimuth() != acquisition.n_azimuth || beta0.n_range() != acquisition.n_range) {
    throw UsageError("image formation: expected an image of the acquisition's " +
                     std::to_string(acquisition.n_azimuth) + " x " + std::to_string(acquisition.n_range) +
                     " pixels, found " + std::to_string(beta0.n_azimuth()) + " x " +
                     std::to_string(beta0.n_range()));
  }
  require_meaning(formation);
  const ImpulseResponse response =
      impulse_response(formation, acquisition.azimuth_spacing_m, acquisition.range_spacing_m);
  std::vector<double> noise;
  if (formation.nesz_db) noise = noise_power(*formation.nesz_db, acquisition, reference_height_m);

  if (formation.speckle()) {
    const WhiteNoise random =
        WhiteNoise(formation.seed).stream(acquisition.azimuth_rad).stream(acquisition.incidence_rad);
    apply_speckle(beta0, response, look_weights(formation.looks), noise, random, monitor);
  } else {
    if (formation.resolution_m) convolve_power(beta0, response, monitor);
    for (int i = 0; i < beta0.n_azimuth() && !noise.empty(); ++i) {
      for (std::size_t j = 0; j < noise.size(); ++j) {
        beta0.row(i)[j] = static_cast<float>(double(beta0.row(i)[j]) + noise[j]);
      }
    }
  }
  return static_cast<int>(std::count(noise.begin(), noise.end(), 0.0));
}

std::uint64_t formation_bytes_per_pixel(const ImageFormation& formation) {
  if (formation.speckle()) return sizeof(double) + (formation.nesz_db ? 4 : 2) * sizeof(float);
  return formation.resolution_m ? sizeof(float) : 0;
}

}  // namespace sarnerf

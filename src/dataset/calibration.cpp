// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/dataset/calibration.h"

#include <cmath>
#include <string>

#include "sarnerf/core/error.h"

namespace sarnerf {
namespace {

constexpr std::string_view kQuantities[] = {"power", "amplitude"};
constexpr std::string_view kCalibrations[] = {"beta0", "sigma0", "gamma0", "uncalibrated"};

template <class Enum, std::size_t N>
Enum from_name(const std::string_view (&names)[N], std::string_view name, const char* what) {
  std::string known;
  for (std::size_t n = 0; n < N; ++n) {
    if (names[n] == name) return static_cast<Enum>(n);
    known += (n > 0 ? ", " : "") + std::string(names[n]);
  }
  throw UsageError("there is no " + std::string(what) + " '" + std::string(name) + "'; known: " +
                   known);
}

}  // namespace

std::string_view name(Quantity quantity) { return kQuantities[static_cast<int>(quantity)]; }
std::string_view name(Calibration calibration) {
  return kCalibrations[static_cast<int>(calibration)];
}

Quantity quantity_from_name(std::string_view name) {
  return from_name<Quantity>(kQuantities, name, "quantity");
}
Calibration calibration_from_name(std::string_view name) {
  return from_name<Calibration>(kCalibrations, name, "calibration");
}

int calibrate(Image<float>& beta0, const Acquisition& acquisition, double reference_height_m,
              Calibration calibration) {
  if (calibration == Calibration::beta0) return 0;
  if (calibration == Calibration::uncalibrated) {
    throw UsageError("an image cannot be brought to 'uncalibrated'; choose beta0, sigma0 or gamma0");
  }
  const double height_m = acquisition.altitude_m() + acquisition.aim_m.y - reference_height_m;
  if (!(height_m > 0.0)) {
    throw GeometryError("calibration needs a radar above the reference plane; it stands " +
                        std::to_string(-height_m) +
                        " m below it: raise the altitude or lower --ground-height");
  }
  int n_without_incidence = 0;
  for (int j = 0; j < beta0.n_range(); ++j) {
    const double cosine = height_m / acquisition.range_m(j);
    double factor = 0.0;
    if (cosine < 1.0) {
      const double sine = std::sqrt((1.0 - cosine) * (1.0 + cosine));
      factor = calibration == Calibration::sigma0 ? sine : sine / cosine;
    } else {
      ++n_without_incidence;
    }
    for (int i = 0; i < beta0.n_azimuth(); ++i) {
      beta0(i, j) = static_cast<float>(beta0(i, j) * factor);
    }
  }
  return n_without_incidence;
}

void take_amplitude(Image<float>& power) {
  for (float& p : power.pixels()) p = std::sqrt(p);
}

}  // namespace sarnerf

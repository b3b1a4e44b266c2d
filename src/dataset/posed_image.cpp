// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/dataset/posed_image.h"

#include <algorithm>
#include <cmath>
#include <queue>
#include <set>
#include <string>
#include <vector>

#include "sarnerf/core/units.h"
#include "sarnerf/core/error.h"
#include "sarnerf/core/metrics.h"
#include "sarnerf/core/numbers.h"
#include "sarnerf/core/parallel.h"
#include "sarnerf/core/text.h"
#include "sarnerf/dataset/image_file.h"

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

void require_calibration(const Acquisition& acquisition, double reference_height_m, Calibration calibration) {
  if (calibration == Calibration::beta0) return;
  if (calibration == Calibration::uncalibrated) {
    throw UsageError("an image cannot be brought to 'uncalibrated'; choose beta0, sigma0 or gamma0");
  }
  const double height_m = acquisition.altitude_m() + acquisition.aim_m.y - reference_height_m;
  if (!(height_m > 0.0)) {
    throw GeometryError("calibration needs a radar above the reference plane; it stands " +
                        std::to_string(-height_m) +
                        " m below it: raise the altitude or lower --ground-height");
  }
}

int calibrate(Image<float>& beta0, const Acquisition& acquisition, double reference_height_m, Calibration calibration) {
  require_calibration(acquisition, reference_height_m, calibration);
  if (calibration == Calibration::beta0) return 0;
  const double height_m = acquisition.altitude_m() + acquisition.aim_m.y - reference_height_m;
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

namespace {

bool along_i(Axis axis) { return axis == Axis::plus_i || axis == Axis::minus_i; }
bool backwards(Axis axis) { return axis == Axis::minus_i || axis == Axis::minus_j; }

std::string size_text(int n_azimuth, int n_range) {
  return std::to_string(n_azimuth) + " x " + std::to_string(n_range);
}

/// Converts stored values to linear power in place.
void to_power(Image<float>& image, const Dataset& dataset, const std::string& where) {
  const bool amplitude = dataset.quantity == Quantity::amplitude;
  for (float& value : image.pixels()) {
    const double physical = double{value} * dataset.scale;
    if (physical < 0.0)
      throw InputError(where + ": " + std::string(name(dataset.quantity)) +
                       " cannot be negative, found " + std::to_string(physical) +
                       "; write values without noise subtraction, or clamp them at 0");
    value = static_cast<float>(amplitude ? physical * physical : physical);
    if (!std::isfinite(value))
      throw InputError(where + ": a value times the dataset's scale, " +
                       std::to_string(dataset.scale) + ", is beyond float32; choose another scale");
  }
}

PosedImage load_one(const std::filesystem::path& folder, const Dataset& dataset,
                    const DatasetView& view) {
  const std::filesystem::path path = folder / view.image;
  PosedImage posed{view.image, acquisition_of(view, dataset.aim_m),
                   to_radar_axes(read_image(path), view.axes)};
  const Image<float>& power = posed.power;
  if (power.n_azimuth() != view.n_azimuth || power.n_range() != view.n_range)
    throw InputError(path.string() + ": " + size_text(power.n_azimuth(), power.n_range()) +
                     " pixels (azimuth x range) where " + std::string(kManifestName) + " says " +
                     size_text(view.n_azimuth, view.n_range) +
                     "; check n_azimuth, n_range and axes of this view");
  to_power(posed.power, dataset, path.string());
  return posed;
}

}  // namespace

Image<float> to_radar_axes(const Image<float>& file, const std::array<Axis, 2>& axes) {
  if (along_i(axes[0]) == along_i(axes[1]))
    throw UsageError("axes must name azimuth (i) once and range (j) once");
  const int n_rows = file.n_azimuth(), n_columns = file.n_range();
  const bool rows_are_azimuth = along_i(axes[0]);
  if (rows_are_azimuth && !backwards(axes[0]) && !backwards(axes[1])) return file;

  Image<float> radar = rows_are_azimuth ? Image<float>(n_rows, n_columns) : Image<float>(n_columns, n_rows);
  for (int row = 0; row < n_rows; ++row) {
    const int p = backwards(axes[0]) ? n_rows - 1 - row : row;
    for (int column = 0; column < n_columns; ++column) {
      const int q = backwards(axes[1]) ? n_columns - 1 - column : column;
      (rows_are_azimuth ? radar(p, q) : radar(q, p)) = file(row, column);
    }
  }
  return radar;
}

std::vector<PosedImage> load_images(const std::filesystem::path& folder, const Dataset& dataset,
                                    std::span<const std::size_t> which, const Monitor& monitor) {
  std::vector<PosedImage> images(which.size());
  parallel_for(which.size(), 1, [&](std::size_t begin, std::size_t end, int) {
    for (std::size_t n = begin; n < end; ++n) {
      monitor.check();
      images[n] = load_one(folder, dataset, dataset.views.at(which[n]));
    }
  });
  return images;
}

namespace {

constexpr std::size_t kMostViews = 24;
constexpr double kFlattest = 0.9;       ///< quantile over a view's windows
constexpr double kSpeckledBelow = 50.0;  ///< looks

constexpr float kFaintest = 1e-8f;        ///< visible power, relative to the peak

bool most_exceed(std::span<const PosedImage> images, float power) {
  std::size_t n_above = 0, n = 0;
  for (const PosedImage& image : images) {
    n += image.power.pixels().size();
    for (const float p : image.power.pixels()) n_above += p > power;
  }
  return 2 * n_above > n;
}

}  // namespace

bool has_background(std::span<const PosedImage> images) { return most_exceed(images, 0.0f); }

bool has_visible_background(std::span<const PosedImage> images) {
  float peak = 0.0f;
  for (const PosedImage& image : images) {
    for (const float p : image.power.pixels()) peak = std::max(peak, p);
  }
  return most_exceed(images, kFaintest * peak);
}

std::optional<double> looks_of(std::span<const PosedImage> images) {
  if (!has_visible_background(images)) return std::nullopt;
  const LooksRule rule{.quantile = kFlattest};
  const std::size_t count = std::min(images.size(), kMostViews);
  std::vector<double> looks;
  for (std::size_t n = 0; n < count; ++n) {
    if (const auto value = equivalent_looks(images[n * images.size() / count].power, rule))
      looks.push_back(*value);
  }
  if (looks.empty()) return std::nullopt;
  return median(looks);
}

bool is_speckle(std::optional<double> looks) { return looks && *looks < kSpeckledBelow; }

bool is_speckled(std::span<const PosedImage> images) { return is_speckle(looks_of(images)); }

std::vector<std::vector<std::size_t>> indices_by_pitch(std::span<const double> incidence_rad) {
  constexpr double kPitchGap_rad = rad_from_deg(0.25);
  std::vector<double> sorted(incidence_rad.begin(), incidence_rad.end());
  std::sort(sorted.begin(), sorted.end());
  std::vector<double> last_of_pitch;
  for (std::size_t n = 0; n < sorted.size(); ++n)
    if (n + 1 == sorted.size() || sorted[n + 1] - sorted[n] > kPitchGap_rad) last_of_pitch.push_back(sorted[n]);
  std::vector<std::vector<std::size_t>> pitches(last_of_pitch.size());
  for (std::size_t n = 0; n < incidence_rad.size(); ++n) {
    const auto pitch = std::lower_bound(last_of_pitch.begin(), last_of_pitch.end(), incidence_rad[n]) - last_of_pitch.begin();
    pitches[static_cast<std::size_t>(pitch)].push_back(n);
  }
  return pitches;
}

void remove_common_translation(std::span<PosedImage> images) {
  if (images.size() < 2) return;
  glm::dmat3 squares(0.0);
  glm::dvec3 products(0.0);
  const auto add = [&](const glm::dvec3& axis, double shift_m) {
    squares += glm::outerProduct(axis, axis);
    products += shift_m * axis;
  };
  for (const PosedImage& image : images) {
    const RadarFrame frame = radar_frame(image.acquisition);
    add(frame.h, image.acquisition.azimuth_shift_m);
    add(frame.k, image.acquisition.range_shift_m);
  }
  // Views of one direction leave a component of t undetermined; this keeps it at 0.
  squares += 1e-9 * static_cast<double>(images.size()) * glm::dmat3(1.0);
  const glm::dvec3 t = glm::inverse(squares) * products;
  for (PosedImage& image : images) {
    const RadarFrame frame = radar_frame(image.acquisition);
    image.acquisition.azimuth_shift_m -= glm::dot(frame.h, t);
    image.acquisition.range_shift_m -= glm::dot(frame.k, t);
  }
}

namespace {

constexpr float kGap = 10.0f;
constexpr std::size_t kPixelsForEach = 10'000, kImagesForEach = 4;

struct Dimmer {
  bool operator()(const Outlier& a, const Outlier& b) const { return a.power > b.power; }
};

/// The `n` brightest pixels, brightest first.
std::vector<Outlier> brightest(std::span<const PosedImage> images, std::size_t n) {
  std::priority_queue<Outlier, std::vector<Outlier>, Dimmer> kept;
  for (std::size_t v = 0; v < images.size(); ++v) {
    const Image<float>& power = images[v].power;
    for (int i = 0; i < power.n_azimuth(); ++i) {
      const auto row = power.row(i);
      for (int j = 0; j < power.n_range(); ++j) {
        const float p = row[static_cast<std::size_t>(j)];
        if (kept.size() == n && !(p > kept.top().power)) continue;
        if (kept.size() == n) kept.pop();
        kept.push({v, i, j, p, 0.0f});
      }
    }
  }
  std::vector<Outlier> list;
  for (; !kept.empty(); kept.pop()) list.push_back(kept.top());
  std::reverse(list.begin(), list.end());
  return list;
}

}  // namespace

std::vector<Outlier> find_outliers(std::span<const PosedImage> images) {
  std::size_t n_pixels = 0;
  for (const PosedImage& image : images) n_pixels += image.power.pixels().size();
  const std::size_t most = std::max<std::size_t>(1, n_pixels / kPixelsForEach);
  std::vector<Outlier> top = brightest(images, most + 1);
  std::size_t n_above = top.empty() ? 0 : top.size() - 1;
  // Where all other pixels are 0, there is no power to compare with.
  while (n_above > 0 && !(top[n_above].power > 0.0f && top[n_above - 1].power / top[n_above].power > kGap)) --n_above;
  if (n_above == 0) return {};
  const float limit = top[n_above].power;
  top.resize(n_above);
  std::set<std::size_t> holders;
  for (Outlier& outlier : top) {
    outlier.limit = limit;
    holders.insert(outlier.image);
  }
  if (holders.size() * kImagesForEach > images.size()) return {};
  return top;
}

std::vector<Outlier> limit_outliers(std::span<PosedImage> images) {
  std::vector<Outlier> outliers = find_outliers(images);
  for (const Outlier& o : outliers) images[o.image].power(o.i, o.j) = o.limit;
  return outliers;
}

std::string outlier_text(const Outlier& outlier, std::span<const PosedImage> images) {
  return format("%s: pixel %d, %d (azimuth row, range bin) holds a power of %.3g, and other images confirm no more than "
                "%.3g, which is used instead; is the file damaged?",
                images[outlier.image].name.c_str(), outlier.i, outlier.j, double{outlier.power}, double{outlier.limit});
}

}  // namespace sarnerf

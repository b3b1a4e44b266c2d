// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/dataset/posed_image.h"

#include <cmath>

#include "sarnerf/core/error.h"
#include "sarnerf/core/parallel.h"
#include "sarnerf/dataset/image_file.h"

namespace sarnerf {
namespace {

bool along_i(Axis axis) { return axis == Axis::plus_i || axis == Axis::minus_i; }
bool backwards(Axis axis) { return axis == Axis::minus_i || axis == Axis::minus_j; }

std::string size_text(int n_azimuth, int n_range) {
  return std::to_string(n_azimuth) + " x " + std::to_string(n_range);
}

/// Stored values to linear power in place.
void to_power(Image<float>& image, const Dataset& dataset, const std::string& where) {
  const bool amplitude = dataset.quantity == Quantity::amplitude;
  for (float& value : image.pixels()) {
    const double physical = double{value} * dataset.scale;
    if (physical < 0.0)
      throw InputError(where + ": " + std::string(name(dataset.quantity)) +
                       " cannot be negative, found " + std::to_string(physical) +
                       "; write what was measured without noise subtracted, or clamp it at 0");
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

}  // namespace sarnerf

// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "app_main.h"
#include "studies.h"
#include "sarnerf/core/error.h"
#include "sarnerf/core/files.h"
#include "sarnerf/core/metrics.h"
#include "sarnerf/core/numbers.h"
#include "sarnerf/core/text.h"
#include "sarnerf/dataset/image_file.h"
#include "sarnerf/dataset/posed_image.h"

namespace sarnerf::bench {

namespace {

namespace fs = std::filesystem;

/// A dataset's images, in the order of its views.
struct Views {
  fs::path folder;
  Dataset dataset;
  std::vector<PosedImage> images;

  explicit Views(const fs::path& from) : folder(from), dataset(read_manifest(from)) {
    std::vector<std::size_t> all(dataset.views.size());
    std::iota(all.begin(), all.end(), std::size_t{0});
    images = load_images(folder, dataset, all);
  }

  /// Its image of a view, or null. Throws UsageError if it has another size.
  const Image<float>* image_of(const DatasetView& wanted) const;
};

const Image<float>* Views::image_of(const DatasetView& wanted) const {
  for (std::size_t n = 0; n < images.size(); ++n) {
    if (!same_angles(dataset.views[n], wanted)) continue;
    const Image<float>& image = images[n].power;
    if (image.n_azimuth() != wanted.n_azimuth || image.n_range() != wanted.n_range)
      throw UsageError(format("%s: the view at azimuth %g, incidence %g degrees has %d x %d pixels, the first dataset's has %d x %d",
                              folder.string().c_str(), wanted.azimuth_deg, wanted.incidence_deg, image.n_azimuth(), image.n_range(),
                              wanted.n_azimuth, wanted.n_range));
    return &image;
  }
  return nullptr;
}

std::vector<Views> read_all(const std::vector<fs::path>& folders) {
  std::vector<Views> all;
  for (const fs::path& folder : folders) all.emplace_back(folder);
  return all;
}

constexpr int kFrame = 3;  ///< pixels around each image
constexpr Colour kPaper{255, 255, 255}, kTrained{214, 39, 40};

/// Draws an image into its place, with a frame of its colour.
void draw(Image<Colour>& picture, const Image<std::uint8_t>& levels, int top, int left, int zoom, const Colour& frame) {
  const int height = levels.n_azimuth() * zoom, width = levels.n_range() * zoom;
  for (int row = -kFrame; row < height + kFrame; ++row)
    for (int column = -kFrame; column < width + kFrame; ++column) {
      const bool inside = row >= 0 && row < height && column >= 0 && column < width;
      const std::uint8_t level = inside ? levels(row / zoom, column / zoom) : std::uint8_t{0};
      picture(top + row, left + column) = inside ? Colour{level, level, level} : frame;
    }
}

Image<float> difference(const Image<float>& a, const Image<float>& b) {
  Image<float> size(a.n_azimuth(), a.n_range());
  for (std::size_t n = 0; n < size.pixels().size(); ++n) size.pixels()[n] = std::abs(a.pixels()[n] - b.pixels()[n]);
  return size;
}

}  // namespace

void run_strip_command(const StripOptions& o, app::Console& console) {
  if (o.quiet) console.set_verbosity(-1);
  if (o.with_difference && o.datasets.size() < 2) throw UsageError("--difference: expected two datasets or more, found one");
  const std::vector<Views> rows = read_all(o.datasets);
  const std::vector<DatasetView>& columns = rows.front().dataset.views;
  std::vector<DatasetView> trained;
  if (!o.trained.empty()) trained = read_manifest(o.trained).views;
  const auto is_trained = [&](const DatasetView& view) {
    return std::any_of(trained.begin(), trained.end(), [&](const DatasetView& t) { return same_angles(t, view); });
  };
  float white = 0.0f;
  for (const PosedImage& image : rows.front().images) white = std::max(white, white_level(image.power));

  int width = kFrame, height = 0;
  for (const DatasetView& view : columns) {
    width += view.n_range * o.zoom + 2 * kFrame;
    height = std::max(height, view.n_azimuth * o.zoom + 2 * kFrame);
  }
  const int n_rows = static_cast<int>(rows.size()) + (o.with_difference ? 1 : 0);
  Image<Colour> picture(height * n_rows, width - kFrame, kPaper);
  int left = kFrame;
  for (const DatasetView& view : columns) {
    const Colour frame = is_trained(view) ? kTrained : kPaper;
    const auto put = [&](int row, const Image<float>& image) {
      draw(picture, display_levels(image, Quantity::power, white), row * height + kFrame, left, o.zoom, frame);
    };
    for (std::size_t r = 0; r < rows.size(); ++r) {
      const Image<float>* image = rows[r].image_of(view);
      if (image) put(static_cast<int>(r), *image);
      if (!image && !is_trained(view))
        throw UsageError(format("%s: expected a view at azimuth %g, incidence %g degrees, as the first dataset has, found none",
                                rows[r].folder.string().c_str(), view.azimuth_deg, view.incidence_deg));
    }
    const Image<float>* second = o.with_difference ? rows[1].image_of(view) : nullptr;
    if (second) put(n_rows - 1, difference(*rows[0].image_of(view), *second));
    left += view.n_range * o.zoom + 2 * kFrame;
  }
  AtomicFiles files;
  files.add(o.output, encode_png(picture));
  files.commit();
  app::print_result(o.output.string() + "\n");
}

namespace {

/// The middle row of a layer of one view, from near to far range; nothing where the dataset has no such layer.
std::optional<std::vector<float>> middle_row(const fs::path& folder, const DatasetView& view, const std::string& layer) {
  const fs::path file = folder / "layers" / (fs::path(view.image).stem().string() + "." + layer + ".tif");
  if (!fs::exists(file)) return std::nullopt;
  const Image<float> image = read_image(file);
  const std::span<const float> row = image.row(image.n_azimuth() / 2);
  return std::vector<float>(row.begin(), row.end());
}

/// Metres from the first bin that is in to the end of the last one.
template <class IsIn>
double extent_m(const std::vector<float>& row, double spacing_m, const IsIn& is_in) {
  const auto first = std::find_if(row.begin(), row.end(), is_in);
  const auto last = std::find_if(row.rbegin(), row.rend(), is_in).base();
  return first == row.end() ? 0.0 : spacing_m * static_cast<double>(last - first);
}

/// Where a component's brightness exceeds half of its median: a bin that it fills to a part counts if the part is the larger one.
double component_extent_m(const std::vector<float>& row, double spacing_m) {
  std::vector<float> bright;
  for (const float power : row) {
    if (power > 0.0f) bright.push_back(power);
  }
  const float least = 0.5f * median(bright);
  return extent_m(row, spacing_m, [least](float power) { return power > least; });
}

}  // namespace

void run_extents_command(const ExtentsOptions& o, app::Console& console) {
  if (o.quiet) console.set_verbosity(-1);
  constexpr float kShadow = 1.0f;  // of the mask; 3 is layover over a hidden point, which is not dark
  std::string text = "| dataset | view | wall (m) | roof (m) | shadow (m) | difference to the first |\n|---|--:|--:|--:|--:|--:|\n";
  const std::vector<Views> all = read_all(o.datasets);
  for (const Views& views : all) {
    for (std::size_t n = 0; n < views.images.size(); ++n) {
      const DatasetView& view = views.dataset.views[n];
      const double spacing_m = view.range_spacing_m;
      text += format("| %s | %g° | ", views.folder.filename().string().c_str(), view.azimuth_deg);
      for (const char* component : {"wall", "roof"}) {
        const auto row = middle_row(views.folder, view, component);
        text += (row ? format("%.2f", component_extent_m(*row, spacing_m)) : "–") + " | ";
      }
      const auto mask = middle_row(views.folder, view, "mask");
      const auto is_shadow = [](float value) { return value == kShadow; };
      text += (mask ? format("%.2f", extent_m(*mask, spacing_m, is_shadow)) : "–") + " | ";
      const Image<float>* first = all.front().image_of(view);
      text += (&views == &all.front() || !first ? "–" : format("%.2f %%", 100.0 * relative_l2_error(views.images[n].power, *first))) + " |\n";
    }
  }
  app::print_result(text);
}

}  // namespace sarnerf::bench

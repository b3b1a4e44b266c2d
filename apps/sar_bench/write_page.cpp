// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <numeric>
#include <span>
#include <string>
#include <vector>

#include "app_main.h"
#include "studies.h"
#include "sarnerf/core/error.h"
#include "sarnerf/core/files.h"
#include "sarnerf/core/text.h"
#include "sarnerf/dataset/image_file.h"
#include "sarnerf/dataset/posed_image.h"
#include "sarnerf/report/page.h"

namespace sarnerf::bench {

namespace {

namespace fs = std::filesystem;

Pixels pixels_of(const fs::path& file) {
  if (file.extension() == ".tif" || file.extension() == ".tiff") return display_levels(read_image(file), Quantity::power);
  return read_picture(file);
}

}  // namespace

void run_page_command(const PageOptions& o, app::Console& console) {
  if (o.quiet) console.set_verbosity(-1);
  fs::path output = o.output;
  if (output.empty()) output = fs::path(o.input).replace_extension(".html");
  std::error_code ignored;
  if (fs::equivalent(output, o.input, ignored))
    throw UsageError("the page " + output.string() + " would replace its Markdown; choose another name (-o)");
  const std::string text = read_whole_file(o.input);
  Page page;
  try {
    page = page_of_markdown(text, [&](const std::string& file) { return pixels_of(o.input.parent_path() / file); });
  } catch (const UsageError& error) {
    throw InputError(o.input.string() + ": " + error.what());
  }
  if (page.title.empty()) page.title = o.input.stem().string();
  write_file_atomically(output, page_html(page));
  app::print_result(output.string() + "\n");
}

namespace {

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
};

bool is_same_view(const DatasetView& a, const DatasetView& b) {
  constexpr double kAlike_deg = 0.01;
  const double turn_deg = std::remainder(a.azimuth_deg - b.azimuth_deg, 360.0);
  return std::abs(turn_deg) < kAlike_deg && std::abs(a.incidence_deg - b.incidence_deg) < kAlike_deg;
}

const Image<float>& image_of(const Views& views, const DatasetView& wanted) {
  for (std::size_t n = 0; n < views.images.size(); ++n) {
    if (!is_same_view(views.dataset.views[n], wanted)) continue;
    const Image<float>& image = views.images[n].power;
    if (image.n_azimuth() != wanted.n_azimuth || image.n_range() != wanted.n_range)
      throw UsageError(format("%s: the view at azimuth %g, incidence %g degrees has %d x %d pixels, the first dataset's has %d x %d",
                              views.folder.string().c_str(), wanted.azimuth_deg, wanted.incidence_deg, image.n_azimuth(), image.n_range(),
                              wanted.n_azimuth, wanted.n_range));
    return image;
  }
  throw UsageError(format("%s: expected a view at azimuth %g, incidence %g degrees, as the first dataset has, found none",
                          views.folder.string().c_str(), wanted.azimuth_deg, wanted.incidence_deg));
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

}  // namespace

void run_strip_command(const StripOptions& o, app::Console& console) {
  if (o.quiet) console.set_verbosity(-1);
  std::vector<Views> rows;
  for (const fs::path& folder : o.datasets) rows.emplace_back(folder);
  const std::vector<DatasetView>& columns = rows.front().dataset.views;
  std::vector<DatasetView> trained;
  if (!o.trained.empty()) trained = read_manifest(o.trained).views;
  float white = 0.0f;
  for (const PosedImage& image : rows.front().images) white = std::max(white, white_level(image.power));

  int width = kFrame, height = 0;
  for (const DatasetView& view : columns) {
    width += view.n_range * o.zoom + 2 * kFrame;
    height = std::max(height, view.n_azimuth * o.zoom + 2 * kFrame);
  }
  Image<Colour> picture(height * static_cast<int>(rows.size()), width - kFrame, kPaper);
  for (std::size_t r = 0; r < rows.size(); ++r) {
    int left = 0;
    for (const DatasetView& view : columns) {
      const bool is_trained = std::any_of(trained.begin(), trained.end(), [&](const DatasetView& t) { return is_same_view(t, view); });
      const Image<std::uint8_t> levels = display_levels(image_of(rows[r], view), Quantity::power, white);
      draw(picture, levels, static_cast<int>(r) * height + kFrame, left + kFrame, o.zoom, is_trained ? kTrained : kPaper);
      left += view.n_range * o.zoom + 2 * kFrame;
    }
  }
  const std::vector<std::byte> png = encode_png(picture);
  write_file_atomically(o.output, std::string(reinterpret_cast<const char*>(png.data()), png.size()));
  app::print_result(o.output.string() + "\n");
}

}  // namespace sarnerf::bench

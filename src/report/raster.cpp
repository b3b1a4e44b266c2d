// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/report/raster.h"

#include <librsvg/rsvg.h>

#include <cmath>
#include <memory>

#include "sarnerf/core/error.h"
#include "svg_writer.h"

namespace sarnerf {
namespace {

constexpr double kLargestSide = 32767.0;  // of a cairo surface
constexpr double kMostPixels = 256.0 * 1024.0 * 1024.0;

/// What librsvg says went wrong, owned.
class RsvgError {
 public:
  ~RsvgError() { g_clear_error(&error_); }
  GError** out() { return &error_; }
  std::string message() const { return error_ != nullptr ? error_->message : "no reason given"; }

 private:
  GError* error_ = nullptr;
};

struct Release {
  void operator()(RsvgHandle* handle) const { g_object_unref(handle); }
  void operator()(cairo_surface_t* surface) const { cairo_surface_destroy(surface); }
  void operator()(cairo_t* context) const { cairo_destroy(context); }
};
template <class T>
using Owned = std::unique_ptr<T, Release>;

void check(cairo_status_t status) {
  if (status != CAIRO_STATUS_SUCCESS) {
    throw Error(std::string("a plot could not be drawn: ") + cairo_status_to_string(status));
  }
}

/// Called through C, so nothing may be thrown.
cairo_status_t append(void* closure, const unsigned char* data, unsigned int length) noexcept try {
  auto& bytes = *static_cast<std::vector<std::byte>*>(closure);
  const auto* first = reinterpret_cast<const std::byte*>(data);
  bytes.insert(bytes.end(), first, first + length);
  return CAIRO_STATUS_SUCCESS;
} catch (...) {
  return CAIRO_STATUS_NO_MEMORY;
}

}  // namespace

std::vector<std::byte> png_of_svg(const std::string& svg, double scale) {
  if (!(scale > 0.0 && std::isfinite(scale))) {
    throw UsageError("picture: expected a scale above zero, found " + std::to_string(scale));
  }
  RsvgError error;
  const Owned<RsvgHandle> handle(rsvg_handle_new_from_data(
      reinterpret_cast<const guint8*>(svg.data()), svg.size(), error.out()));
  if (!handle) throw InputError("picture: expected an SVG document: " + error.message());
  double width = 0.0, height = 0.0;
  if (!rsvg_handle_get_intrinsic_size_in_pixels(handle.get(), &width, &height) || !(width > 0.0) ||
      !(height > 0.0)) {
    throw InputError(
        "picture: expected an SVG document with a width and a height in pixels, found none");
  }
  width = std::ceil(width * scale);
  height = std::ceil(height * scale);
  if (!(width <= kLargestSide && height <= kLargestSide && width * height <= kMostPixels)) {
    throw UsageError(
        "picture: expected at most 32767 pixels a side and 256 million in all, found " +
        number(width) + " x " + number(height) + "; choose a smaller scale");
  }

  const Owned<cairo_surface_t> surface(
      cairo_image_surface_create(CAIRO_FORMAT_RGB24, int(width), int(height)));
  check(cairo_surface_status(surface.get()));
  const Owned<cairo_t> context(cairo_create(surface.get()));
  cairo_set_source_rgb(context.get(), 1.0, 1.0, 1.0);
  cairo_paint(context.get());
  const RsvgRectangle everywhere{0.0, 0.0, width, height};
  if (!rsvg_handle_render_document(handle.get(), context.get(), &everywhere, error.out())) {
    throw Error("a plot could not be drawn: " + error.message());
  }
  check(cairo_status(context.get()));

  std::vector<std::byte> png;
  check(cairo_surface_write_to_png_stream(surface.get(), append, &png));
  return png;
}

}  // namespace sarnerf

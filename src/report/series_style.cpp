// SPDX-License-Identifier: Apache-2.0
#include "series_style.h"

#include <array>
#include <cmath>
#include <numbers>

#include "svg_writer.h"

namespace sarnerf {
namespace {

/// Okabe and Ito's colours in an order that keeps neighbours apart. Their yellow vanishes on white: grey
/// instead. Their black is for what is emphasised.
constexpr std::array<std::string_view, 7> kPalette{"#0072b2", "#d55e00", "#009e73", "#cc79a7",
                                                   "#e69f00", "#56b4e9", "#777777"};

constexpr std::array<PlotMarker, 8> kMarkers{
    PlotMarker::circle,        PlotMarker::square,   PlotMarker::triangle, PlotMarker::diamond,
    PlotMarker::triangle_down, PlotMarker::pentagon, PlotMarker::cross,    PlotMarker::plus};

/// A line with more points than this is a curve: markers would only hide it.
constexpr std::size_t kMostMarkedPoints = 60;

std::string polygon(Spot centre, double radius_px, int corners, double first_rad) {
  std::string path;
  for (int n = 0; n < corners; ++n) {
    const double angle = first_rad + 2.0 * std::numbers::pi * n / corners;
    path += n == 0 ? 'M' : 'L';
    path += number(centre.x + radius_px * std::cos(angle)) + ' ' +
            number(centre.y + radius_px * std::sin(angle));
  }
  return path + 'Z';
}

/// A bold plus, turned by `angle_rad`.
std::string bars(Spot centre, double reach_px, double angle_rad) {
  const double half = 0.34 * reach_px;
  std::string path;
  for (int arm = 0; arm < 4; ++arm) {
    const double angle = angle_rad + 0.5 * std::numbers::pi * arm;
    const double c = std::cos(angle), s = std::sin(angle);
    // The arm's two outer corners, and the inner one before the next arm.
    for (const Spot p : {Spot{reach_px, -half}, Spot{reach_px, half}, Spot{half, half}}) {
      path += path.empty() ? 'M' : 'L';
      path += number(centre.x + c * p.x - s * p.y) + ' ' + number(centre.y + s * p.x + c * p.y);
    }
  }
  return path + 'Z';
}

}  // namespace

std::vector<SeriesStyle> series_styles(const Plot& plot) {
  std::vector<SeriesStyle> styles;
  std::size_t next_colour = 0, next_shape = 0;  // rings take none, what is emphasised no colour
  for (const PlotSeries& series : plot.series) {
    SeriesStyle style;
    const bool ring = series.marker == PlotMarker::ring;
    const std::size_t shape = ring ? 0 : next_shape++;
    const std::size_t number = ring || series.emphasised ? 0 : next_colour++;
    // A negative number finds its place in the palette, too.
    const auto chosen = series.colour ? std::size_t(*series.colour % 7 + 7) : number;
    style.colour = series.emphasised ? kInk : kPalette[chosen % kPalette.size()];
    style.line = series.line;
    style.emphasised = series.emphasised;
    style.marker = series.marker;
    if (style.marker == PlotMarker::automatic) {
      const bool curve = series.points.size() > kMostMarkedPoints && series.line != PlotLine::none;
      style.marker = curve ? PlotMarker::none : kMarkers[shape % kMarkers.size()];
    }
    if (style.marker != PlotMarker::none) {
      style.marker_radius_px = (style.marker == PlotMarker::ring ? 0.52 : 0.31) * plot.text_px;
    }
    styles.push_back(style);
  }
  return styles;
}

std::string marker_path(PlotMarker marker, Spot centre, double radius_px) {
  constexpr double kQuarter = 0.5 * std::numbers::pi;
  switch (marker) {
    case PlotMarker::square:
      return polygon(centre, 1.25 * radius_px, 4, 0.5 * kQuarter);
    case PlotMarker::diamond:
      return polygon(centre, 1.3 * radius_px, 4, 0.0);
    case PlotMarker::triangle:
      return polygon({centre.x, centre.y + 0.2 * radius_px}, 1.4 * radius_px, 3, -kQuarter);
    case PlotMarker::triangle_down:
      return polygon({centre.x, centre.y - 0.2 * radius_px}, 1.4 * radius_px, 3, kQuarter);
    case PlotMarker::pentagon:
      return polygon(centre, 1.15 * radius_px, 5, -kQuarter);
    case PlotMarker::plus:
      return bars(centre, 1.2 * radius_px, 0.0);
    case PlotMarker::cross:
      return bars(centre, 1.2 * radius_px, 0.5 * kQuarter);
    case PlotMarker::none:
      return {};
    case PlotMarker::automatic:
    case PlotMarker::ring:
    case PlotMarker::circle:
      break;
  }
  const std::string r = number(radius_px), across = number(2.0 * radius_px);
  const std::string arc = "a" + r + ' ' + r + " 0 1 0 ";
  return 'M' + number(centre.x - radius_px) + ' ' + number(centre.y) + arc + across + " 0" + arc +
         '-' + across + " 0Z";
}

std::string marker_paint(const SeriesStyle& style, double unit_px) {
  const std::string colour(style.colour);
  if (style.marker == PlotMarker::ring) {
    return "fill=\"none\" stroke=\"" + colour + "\" stroke-width=\"" + number(1.5 * unit_px) + '"';
  }
  // The thin light border keeps markers apart where they crowd.
  return "fill=\"" + colour + "\" stroke=\"" + std::string(kPaper) + "\" stroke-width=\"" +
         number(0.8 * unit_px) + '"';
}

std::string line_paint(const SeriesStyle& style, double unit_px) {
  std::string paint = "fill=\"none\" stroke=\"" + std::string(style.colour) + "\" stroke-width=\"" +
                      number((style.emphasised ? 2.0 : 1.7) * unit_px) +
                      "\" stroke-linejoin=\"round\"";
  if (style.line == PlotLine::dashed) {
    paint += " stroke-dasharray=\"" + number(6.0 * unit_px) + ' ' + number(4.0 * unit_px) + '"';
  }
  return paint;
}

}  // namespace sarnerf

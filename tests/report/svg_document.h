// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <string>
#include <vector>

#include "svg.h"

/// An element of an SVG document, in document order.
struct SvgElement {
  std::string name;
  std::map<std::string, std::string> attributes;
  std::string text;
  std::string group;  ///< the class of the innermost group around it

  double number(const std::string& attribute) const;
};

/// Reads a document strictly: throws std::runtime_error where it is no well-formed XML of elements, attributes
/// and text.
std::vector<SvgElement> parse_svg(const std::string& document);

std::vector<SvgElement> elements_of(const std::vector<SvgElement>& all, const std::string& name,
                                    const std::string& group = "");

/// Advance width of a text in DejaVu Sans, by cairo.
double drawn_width_px(const std::string& text, double size_px, bool bold);

/// The rectangle that a text element covers, from capitals' height to descenders, by cairo's widths and the
/// element's own attributes.
sarnerf::Rect drawn_bounds(const SvgElement& text);

/// The absolute points (M and L) of a path.
std::vector<sarnerf::Spot> points_of(const SvgElement& path);

/// The middle of a circle drawn as a path.
sarnerf::Spot centre_of_circle(const SvgElement& path);

// SPDX-License-Identifier: Apache-2.0
#include "svg_document.h"

#include <cairo.h>

#include <cstdlib>
#include <memory>
#include <stdexcept>

namespace {

/// A cursor over the document.
class Reader {
 public:
  explicit Reader(const std::string& text) : text_(text) {}

  bool at_end() const { return at_ == text_.size(); }
  bool next_is(const std::string& what) const { return text_.compare(at_, what.size(), what) == 0; }
  bool skip(const std::string& what) {
    if (!next_is(what)) return false;
    at_ += what.size();
    return true;
  }
  void expect(const std::string& what) {
    if (!skip(what)) fail("expected '" + what + "'");
  }
  void skip_space() {
    while (!at_end() && std::string(" \n\t").find(text_[at_]) != std::string::npos) ++at_;
  }
  std::string name() {
    std::string found;
    while (!at_end() &&
           (std::isalnum(static_cast<unsigned char>(text_[at_])) || text_[at_] == '-')) {
      found += text_[at_++];
    }
    if (found.empty()) fail("expected a name");
    return found;
  }
  /// Text up to one of `ends`, entities resolved.
  std::string characters(const std::string& ends) {
    std::string found;
    while (!at_end() && ends.find(text_[at_]) == std::string::npos) {
      const auto c = static_cast<unsigned char>(text_[at_]);
      if (c == '<' || (c < 0x20 && c != '\n')) fail("a character that XML forbids");
      if (c != '&') {
        found += text_[at_++];
        continue;
      }
      if (skip("&amp;"))
        found += '&';
      else if (skip("&lt;"))
        found += '<';
      else if (skip("&gt;"))
        found += '>';
      else if (skip("&quot;"))
        found += '"';
      else if (skip("&apos;"))
        found += '\'';
      else
        fail("an unknown entity");
    }
    return found;
  }
  [[noreturn]] void fail(const std::string& why) const {
    throw std::runtime_error("SVG, byte " + std::to_string(at_) + ": " + why);
  }

 private:
  const std::string& text_;
  std::size_t at_ = 0;
};

void parse_element(Reader& in, const std::string& group, std::vector<SvgElement>& all) {
  in.expect("<");
  SvgElement element;
  element.name = in.name();
  element.group = group;
  for (;;) {
    in.skip_space();
    if (in.next_is("/") || in.next_is(">")) break;
    const std::string attribute = in.name();
    in.expect("=\"");
    if (!element.attributes.emplace(attribute, in.characters("\"")).second)
      in.fail("twice: " + attribute);
    in.expect("\"");
  }
  const std::size_t place = all.size();
  const std::string inner = element.name == "g" ? element.attributes["class"] : group;
  const std::string name = element.name;
  all.push_back(std::move(element));
  if (in.skip("/>")) return;
  in.expect(">");
  for (;;) {
    all[place].text += in.characters("<");
    if (in.skip("</")) break;
    if (in.at_end()) in.fail("the document ends within " + name);
    parse_element(in, inner, all);
  }
  if (in.name() != name) in.fail("expected the end of " + name);
  in.expect(">");
}

}  // namespace

double SvgElement::number(const std::string& attribute) const {
  std::size_t used = 0;
  const std::string& written = attributes.at(attribute);
  const double value = std::stod(written, &used);
  if (used != written.size()) throw std::runtime_error(attribute + " is no number: " + written);
  return value;
}

std::vector<SvgElement> parse_svg(const std::string& document) {
  Reader in(document);
  std::vector<SvgElement> all;
  parse_element(in, "", all);
  in.skip_space();
  if (!in.at_end()) in.fail("expected the end of the document");
  return all;
}

std::vector<SvgElement> elements_of(const std::vector<SvgElement>& all, const std::string& name,
                                    const std::string& group) {
  std::vector<SvgElement> found;
  for (const SvgElement& element : all) {
    if (element.name == name && (group.empty() || element.group == group)) found.push_back(element);
  }
  return found;
}

double drawn_width_px(const std::string& text, double size_px, bool bold) {
  const std::unique_ptr<cairo_surface_t, decltype(&cairo_surface_destroy)> surface(
      cairo_image_surface_create(CAIRO_FORMAT_A8, 1, 1), cairo_surface_destroy);
  const std::unique_ptr<cairo_t, decltype(&cairo_destroy)> context(cairo_create(surface.get()),
                                                                   cairo_destroy);
  const std::unique_ptr<cairo_font_options_t, decltype(&cairo_font_options_destroy)> options(
      cairo_font_options_create(), cairo_font_options_destroy);
  cairo_font_options_set_hint_metrics(options.get(), CAIRO_HINT_METRICS_OFF);
  cairo_set_font_options(context.get(), options.get());
  cairo_select_font_face(context.get(), "DejaVu Sans", CAIRO_FONT_SLANT_NORMAL,
                         bold ? CAIRO_FONT_WEIGHT_BOLD : CAIRO_FONT_WEIGHT_NORMAL);
  cairo_set_font_size(context.get(), size_px);
  cairo_text_extents_t extents;
  cairo_text_extents(context.get(), text.c_str(), &extents);
  return extents.x_advance;
}

sarnerf::Rect drawn_bounds(const SvgElement& text) {
  const double size = text.number("font-size"), x = text.number("x"), y = text.number("y");
  const double width = drawn_width_px(text.text, size, text.attributes.count("font-weight") > 0);
  const auto anchor = text.attributes.find("text-anchor");
  double before = 0.0;
  if (anchor != text.attributes.end()) before = anchor->second == "end" ? width : 0.5 * width;
  const double above = 0.76 * size, below = 0.24 * size;
  if (text.attributes.count("transform") > 0)
    return {x - above, y + before - width, x + below, y + before};
  return {x - before, y - above, x - before + width, y + below};
}

std::vector<sarnerf::Spot> points_of(const SvgElement& path) {
  std::vector<sarnerf::Spot> points;
  const std::string& d = path.attributes.at("d");
  for (std::size_t at = d.find_first_of("ML"); at != std::string::npos;
       at = d.find_first_of("ML", at + 1)) {
    char* rest = nullptr;
    const double x = std::strtod(d.c_str() + at + 1, &rest);
    points.push_back({x, std::strtod(rest, nullptr)});
  }
  return points;
}

sarnerf::Spot centre_of_circle(const SvgElement& path) {
  const std::string& d = path.attributes.at("d");
  const auto arc = d.find('a');
  if (arc == std::string::npos) throw std::runtime_error("no circle: " + d);
  const auto first = points_of(path).at(0);
  return {first.x + std::strtod(d.c_str() + arc + 1, nullptr), first.y};
}

// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/report/page.h"

#include <algorithm>
#include <initializer_list>
#include <string>
#include <string_view>
#include <utility>

#include "plot_layout.h"
#include "sarnerf/core/error.h"
#include "sarnerf/dataset/image_file.h"
#include "svg.h"

namespace sarnerf {

namespace {

/// An attribute's name and its unescaped value.
using HtmlAttribute = std::pair<std::string_view, std::string_view>;

/// Text for HTML and XML: cleaned (clean_text()) and escaped.
std::string html_text(std::string_view text) { return escaped(clean_text(text)); }

std::string opening(std::string_view name, std::initializer_list<HtmlAttribute> attributes) {
  std::string out = "<" + std::string(name);
  for (const auto& [attribute, value] : attributes) {
    if (value.empty() && attribute != "alt") continue;
    out += ' ' + std::string(attribute) + "=\"" + html_text(value) + '"';
  }
  return out;
}

/// An element with its end tag, so that every opened element is closed. `inner` is markup.
std::string element(std::string_view name, std::initializer_list<HtmlAttribute> attributes,
                    std::string_view inner) {
  const std::string end = "</" + std::string(name) + ">\n";
  return opening(name, attributes) + '>' + std::string(inner) + end;
}

/// The same, around a text.
std::string text_element(std::string_view name, std::initializer_list<HtmlAttribute> attributes,
                         std::string_view text) {
  return element(name, attributes, html_text(text));
}

/// An element without an end tag in HTML, such as <img …/>.
std::string void_element(std::string_view name, std::initializer_list<HtmlAttribute> attributes) {
  return opening(name, attributes) + "/>\n";
}

/// The style sheet. It must contain neither < nor &, so that it is the same in HTML and in XML.
constexpr std::string_view kStyle = R"(
:root {
  color-scheme: light dark;
  --paper: #ffffff; --panel: #f5f6f8; --ink: #1a1a1a; --quiet: #555b63; --rule: #d9dce1;
  --accent: #005a8f; --warning: #8a4b00; --warning-paper: #fff5e5;
}
@media (prefers-color-scheme: dark) {
  :root {
    --paper: #16191d; --panel: #1f2329; --ink: #e8eaed; --quiet: #a9b0b9; --rule: #3a4049;
    --accent: #6cb8ea; --warning: #f0b35c; --warning-paper: #2b2417;
  }
}
* { box-sizing: border-box; }
html { -webkit-text-size-adjust: 100%; }
body {
  margin: 0; background: var(--paper); color: var(--ink);
  font: 16px/1.55 system-ui, "Segoe UI", "Helvetica Neue", Arial, "DejaVu Sans", sans-serif;
  overflow-wrap: break-word;
}
header, main { max-width: 1040px; margin: 0 auto; padding: 0 32px; }
header { padding-top: 40px; }
main { padding-bottom: 64px; }
h1 { font-size: 30px; line-height: 1.2; margin: 0 0 8px; letter-spacing: -0.01em; }
h2 {
  font-size: 21px; line-height: 1.3; margin: 48px 0 12px; padding-bottom: 6px;
  border-bottom: 1px solid var(--rule);
}
p { margin: 12px 0; max-width: 46em; }
header p { color: var(--quiet); font-size: 17px; margin: 0 0 12px; }
nav ul {
  list-style: none; margin: 0; padding: 0; display: flex; flex-wrap: wrap; gap: 4px 20px;
  font-size: 14px;
}
nav li { min-width: 0; overflow-wrap: anywhere; }
a { color: var(--accent); }
.notice {
  border-left: 4px solid var(--accent); background: var(--panel); padding: 10px 16px;
  border-radius: 0 4px 4px 0; max-width: none;
}
.warning { border-color: var(--warning); background: var(--warning-paper); }
.warning strong { color: var(--warning); }
.figures {
  list-style: none; display: grid; grid-template-columns: repeat(auto-fit, minmax(150px, 1fr));
  gap: 12px; padding: 0; margin: 24px 0;
}
.figures li { background: var(--panel); border-radius: 6px; padding: 12px 14px; }
.figures strong {
  display: block; font-size: 22px; line-height: 1.25; font-weight: 650;
  font-variant-numeric: tabular-nums;
}
.figures span {
  display: block; color: var(--quiet); font-size: 14px; line-height: 1.35; margin-top: 4px;
}
figure { margin: 24px 0; }
figcaption, caption, summary {
  color: var(--quiet); font-size: 14px; line-height: 1.45; text-align: left;
}
figcaption { margin-top: 8px; max-width: 58em; }
caption { padding-bottom: 8px; }
summary { cursor: pointer; padding: 8px 0; color: var(--accent); }
.table figcaption { margin: 0 0 8px; }
.scroll { overflow-x: auto; margin: 0; }
details .scroll { margin: 8px 0 20px; }
table {
  border-collapse: collapse; font-size: 15px; line-height: 1.4;
  font-variant-numeric: tabular-nums;
}
th, td {
  padding: 6px 14px; text-align: left; white-space: nowrap; border-bottom: 1px solid var(--rule);
  font-weight: 400;
}
th:first-child { padding-left: 2px; }
thead th {
  color: var(--quiet); font-size: 13.5px; vertical-align: bottom; white-space: normal;
  border-bottom: 2px solid var(--rule);
}
.right { text-align: right; }
.ours th, .ours td { font-weight: 700; background: var(--panel); }
.facts { max-width: 100%; }
.facts th { color: var(--quiet); min-width: 9em; }
.facts th, .facts td { white-space: normal; vertical-align: top; overflow-wrap: anywhere; }
.plot svg { display: block; width: 100%; height: auto; }
.plot .wide { max-width: 860px; }
.plot .narrow { display: none; max-width: 460px; }
.pictures {
  display: grid; grid-template-columns: repeat(auto-fit, minmax(min(100%, 160px), 1fr));
  gap: 12px;
}
.pictures div { min-width: 0; }
.pictures span { display: block; font-size: 14px; font-weight: 600; margin-bottom: 4px; }
.pictures img {
  display: block; width: 100%; height: auto; max-height: 480px; object-fit: contain;
  object-position: left top;
}
.pictures .flat { height: 24px; object-fit: fill; }
.pictures .upright { width: 24px; height: 480px; object-fit: fill; }
.coarse { image-rendering: pixelated; }
.scales {
  display: grid; grid-template-columns: repeat(auto-fit, minmax(min(100%, 280px), 1fr));
  gap: 12px 32px; margin: 20px 0; font-size: 13.5px;
}
.scales img {
  display: block; width: 100%; height: 14px; margin: 4px 0 2px; border: 1px solid var(--rule);
}
.labels {
  display: flex; justify-content: space-between; gap: 8px; color: var(--quiet);
  font-variant-numeric: tabular-nums;
}
@media (max-width: 640px) {
  header, main { padding-left: 16px; padding-right: 16px; }
  header { padding-top: 24px; }
  h1 { font-size: 25px; }
  .figures { grid-template-columns: repeat(auto-fit, minmax(130px, 1fr)); }
  th, td { padding: 6px 10px; }
  .facts th { min-width: 8.5em; }
  .plot .wide { display: none; }
  .plot .narrow { display: block; }
}
@media print {
  figure, .figures, .scroll { break-inside: avoid; }
  h2 { break-after: avoid; }
  nav { display: none; }
}
)";

/// Style rules that replace a colour of the plots, in fills and strokes.
std::string repainted(std::string_view from, std::string_view to) {
  std::string rules;
  for (const std::string paints : {"fill", "stroke"}) {
    rules += "  .plot [" + paints + "=\"" + std::string(from) + "\"] { " + paints + ": " +
             std::string(to) + "; }\n";
  }
  return rules;
}

/// The style sheet of a page. On a dark background, plots keep their palette; background, text, axes and grid change.
std::string page_style() {
  return std::string(kStyle) + "@media screen and (prefers-color-scheme: dark) {\n" +
         "  .plot text { fill: var(--ink); }\n" + repainted(kPaper, "var(--paper)") +
         repainted(kInk, "var(--ink)") + repainted(kQuietInk, "var(--quiet)") +
         repainted(kGridInk, "#2d323a") + repainted(kBorderInk, "var(--rule)") + "}\n";
}

/// Pictures of up to this many pixels a side are enlarged without smoothing.
constexpr int kCoarseSide = 400;

/// A picture with a larger ratio of its sides is drawn as a bar: in its own shape it would be too thin to see.
constexpr int kSliver = 20;

/// Plots for narrow windows. The text stays legible on a page of 320 pixels, of which margins take 32.
constexpr double kNarrowText_px = 12.0, kNarrowWidth_px = 320.0, kNarrowHeight_px = 310.0;

/// The page loads only pictures, and only those embedded in it. The style sheet is embedded, too.
constexpr std::string_view kPolicy = "default-src 'none'; img-src data:; style-src 'unsafe-inline'";

std::string section_id(std::size_t section) { return "section-" + std::to_string(section); }

template <class Pixel>
std::string data_uri(const Image<Pixel>& pixels) {
  return "data:image/png;base64," + base64(encode_png(pixels));
}

template <class Pixel>
std::string image_element(const Image<Pixel>& pixels, const std::string& description) {
  if (pixels.pixels().empty()) throw UsageError("page: expected a picture with pixels, found none");
  if (description.empty()) throw UsageError("page: expected a picture's description, found none");
  const int width = pixels.n_range(), height = pixels.n_azimuth();
  std::string look = std::max(width, height) <= kCoarseSide ? "coarse" : "";
  if (width > kSliver * height) look += " flat";
  if (height > kSliver * width) look += " upright";
  return void_element("img", {{"src", data_uri(pixels)},
                              {"width", std::to_string(width)},
                              {"height", std::to_string(height)},
                              {"alt", description},
                              {"class", look}});
}

std::string figure(std::string_view name, const std::string& inner, const std::string& caption) {
  const std::string below = caption.empty() ? "" : text_element("figcaption", {}, caption);
  return element("figure", {{"class", name}}, "\n" + inner + below);
}

/// Turns blocks into HTML, in order. Headings get numbered ids.
class BlockWriter {
 public:
  std::string operator()(const PageHeading& heading) {
    return text_element("h2", {{"id", section_id(++n_sections_)}}, heading.text);
  }

  std::string operator()(const PageParagraph& paragraph) const {
    return text_element("p", {}, paragraph.text);
  }

  std::string operator()(const PageNotice& notice) const {
    const bool warning = notice.kind == PageNotice::Kind::warning;
    const std::string lead = warning ? "<strong>Warning:</strong> " : "";
    return element("p", {{"class", warning ? "notice warning" : "notice"}},
                   lead + html_text(notice.text));
  }

  std::string operator()(const PageFigures& figures) const {
    std::string items = "\n";
    for (const PageFigure& f : figures.figures) {
      items += element("li", {},
                       text_element("strong", {}, f.value) + text_element("span", {}, f.meaning));
    }
    return figures.figures.empty() ? "" : element("ul", {{"class", "figures"}}, items);
  }

  std::string operator()(const PageFacts& facts) const {
    if (facts.facts.empty()) return "";
    std::string rows = "\n";
    for (const PageFact& fact : facts.facts) {
      rows += element(
          "tr", {},
          text_element("th", {{"scope", "row"}}, fact.name) + text_element("td", {}, fact.value));
    }
    const std::string caption =
        facts.caption.empty() ? "" : text_element("caption", {}, facts.caption);
    return element("table", {{"class", "facts"}}, "\n" + caption + element("tbody", {}, rows));
  }

  std::string operator()(const PageTable& table) const {
    check(table);
    std::string headings;
    for (const TableColumn& column : table.columns) {
      headings +=
          text_element("th", {{"scope", "col"}, {"class", alignment(column)}}, column.heading);
    }
    std::string rows = "\n";
    for (std::size_t r = 0; r < table.rows.size(); ++r) {
      const bool ours = std::ranges::find(table.emphasised, r) != table.emphasised.end();
      rows += element("tr", {{"class", ours ? "ours" : ""}}, cells(table, table.rows[r]));
    }
    // The caption is outside of the scrolling box. It opens a folded table.
    const std::string html =
        scrolling(element("table", {},
                          "\n" + element("thead", {}, element("tr", {}, headings)) +
                              element("tbody", {}, rows)),
                  table.caption);
    if (table.folded)
      return element("details", {}, text_element("summary", {}, table.caption) + html);
    const std::string above =
        table.caption.empty() ? "" : text_element("figcaption", {}, table.caption);
    return element("figure", {{"class", "table"}}, "\n" + above + html);
  }

  std::string operator()(const PagePlot& plot) const {
    Plot narrow = plot.plot;
    narrow.text_px = kNarrowText_px;
    narrow.width_px = kNarrowWidth_px;
    narrow.height_px = kNarrowHeight_px;
    narrow.legend_beside = false;
    return figure("plot",
                  element("div", {{"class", "wide"}}, svg(plot.plot)) +
                      element("div", {{"class", "narrow"}}, svg(narrow)),
                  plot.caption);
  }

  std::string operator()(const PagePictures& pictures) const {
    std::string items;
    for (const PagePicture& picture : pictures.pictures) {
      const std::string name = picture.name.empty() ? "" : text_element("span", {}, picture.name);
      const std::string image =
          std::visit([&](const auto& pixels) { return image_element(pixels, picture.description); },
                     picture.pixels);
      items += element("div", {}, name + image);
    }
    return figure("", element("div", {{"class", "pictures"}}, "\n" + items), pictures.caption);
  }

  std::string operator()(const PageScales& scales) const {
    std::string items = "\n";
    for (const PageScale& scale : scales.scales) {
      if (scale.strip.n_azimuth() != 1) {
        throw UsageError("page: expected a scale's colours in one row, found " +
                         std::to_string(scale.strip.n_azimuth()));
      }
      std::string labels;
      for (const std::string& label : scale.labels) labels += text_element("span", {}, label);
      items += element("div", {},
                       text_element("strong", {}, scale.name) +
                           image_element(scale.strip, "the colours of: " + scale.name) +
                           element("div", {{"class", "labels"}}, labels));
    }
    return element("div", {{"class", "scales"}}, items);
  }

 private:
  static void check(const PageTable& table) {
    if (table.columns.empty()) throw UsageError("page: expected a table with columns, found none");
    for (std::size_t r = 0; r < table.rows.size(); ++r) {
      if (table.rows[r].size() == table.columns.size()) continue;
      throw UsageError("page: table '" + table.caption + "': expected " +
                       std::to_string(table.columns.size()) + " cells in row " + std::to_string(r) +
                       ", found " + std::to_string(table.rows[r].size()));
    }
    if (table.folded && table.caption.empty()) {
      throw UsageError("page: expected a caption of a folded table, found none");
    }
  }

  static std::string_view alignment(const TableColumn& column) {
    return column.align == Align::right ? "right" : "";
  }

  static std::string cells(const PageTable& table, const std::vector<std::string>& row) {
    std::string out;
    for (std::size_t c = 0; c < row.size(); ++c) {
      out += c == 0 ? text_element("th", {{"scope", "row"}, {"class", alignment(table.columns[c])}},
                                   row[c])
                    : text_element("td", {{"class", alignment(table.columns[c])}}, row[c]);
    }
    return out;
  }

  /// A box that scrolls, also with the keyboard, when its table is wider than the page.
  static std::string scrolling(const std::string& table, const std::string& caption) {
    return element("div",
                   {{"class", "scroll"},
                    {"role", "region"},
                    {"tabindex", "0"},
                    {"aria-label", caption.empty() ? "table" : caption}},
                   "\n" + table);
  }

  std::size_t n_sections_ = 0;
};

/// The list of contents; none for a page of one section.
std::string contents(const Page& page) {
  std::string items = "\n";
  std::size_t section = 0;
  for (const PageBlock& block : page.blocks) {
    const auto* heading = std::get_if<PageHeading>(&block);
    if (heading == nullptr) continue;
    items += element("li", {},
                     text_element("a", {{"href", "#" + section_id(++section)}}, heading->text));
  }
  if (section < 2) return "";
  return element("nav", {{"aria-label", "Contents"}}, element("ul", {}, items));
}

}  // namespace

std::string page_html(const Page& page) {
  const std::string head =
      void_element("meta", {{"charset", "utf-8"}}) +
      void_element("meta", {{"http-equiv", "Content-Security-Policy"}, {"content", kPolicy}}) +
      void_element("meta",
                   {{"name", "viewport"}, {"content", "width=device-width, initial-scale=1"}}) +
      text_element("title", {}, page.title.empty() ? "Report" : page.title) +
      element("style", {}, page_style());
  std::string header = text_element("h1", {}, page.title.empty() ? "Report" : page.title);
  if (!page.subtitle.empty()) header += text_element("p", {}, page.subtitle);
  std::string blocks = "\n";
  BlockWriter write;
  for (const PageBlock& block : page.blocks) blocks += std::visit(write, block);
  const std::string body =
      element("header", {}, "\n" + header + contents(page)) + element("main", {}, blocks);
  return "<!DOCTYPE html>\n" +
         element("html", {{"lang", "en"}},
                 "\n" + element("head", {}, "\n" + head) + element("body", {}, "\n" + body));
}

}  // namespace sarnerf

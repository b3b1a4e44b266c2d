// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/report/page.h"

#include <algorithm>

#include "base64.h"
#include "html_writer.h"
#include "page_style.h"
#include "sarnerf/core/error.h"
#include "sarnerf/dataset/display.h"

namespace sarnerf {
namespace {

/// Pictures of up to so many pixels a side are enlarged, and show their pixels as they are.
constexpr int kCoarseSide = 400;

/// Beyond this ratio of its sides a picture is drawn as a bar: in its own shape it would be too thin to see.
constexpr int kSliver = 20;

/// A plot for narrow windows: its text stays legible on a page of 320 pixels, of which margins take 32.
constexpr double kNarrowText_px = 12.0, kNarrowWidth_px = 320.0, kNarrowHeight_px = 310.0;

/// Pictures are the only thing that this page loads, and only from itself. The style sheet stands in the page.
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

/// Turns blocks into HTML in their order; headings are numbered.
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
    // The caption stands outside of the box that scrolls; folded, it is what opens the table.
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

  /// A box that scrolls when its table is wider than the page; with the keyboard, too.
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

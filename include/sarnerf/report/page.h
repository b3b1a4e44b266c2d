// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <variant>
#include <vector>

#include "sarnerf/core/image.h"
#include "sarnerf/dataset/image_file.h"
#include "sarnerf/report/plot.h"

namespace sarnerf {

enum class Align { left, right };

struct TableColumn {
  std::string heading;
  Align align = Align::left;
};

/// A Markdown table, padded so that it reads well as plain text too. Bars and line breaks within cells are
/// escaped. Throws UsageError without columns and for a row whose number of cells is not theirs.
std::string markdown_table(const std::vector<TableColumn>& columns,
                           const std::vector<std::vector<std::string>>& rows);

/// The heading of a section. The page's list of contents names them all.
struct PageHeading {
  std::string text;
};

struct PageParagraph {
  std::string text;
};

/// What a reader should not miss.
struct PageNotice {
  enum class Kind { note, warning };
  std::string text;
  Kind kind = Kind::note;
};

/// One figure, large: {"48.2 dB", "PSNR of the held-out views"}.
struct PageFigure {
  std::string value, meaning;
};

struct PageFigures {
  std::vector<PageFigure> figures;
};

/// A name and what belongs to it: {"learning rate", "0.02"}.
struct PageFact {
  std::string name, value;
};

struct PageFacts {
  std::string caption;
  std::vector<PageFact> facts;
};

/// A table as of page.h. Its first column names the rows. Wider than the page, it scrolls by itself.
struct PageTable {
  std::string caption;
  std::vector<TableColumn> columns;
  std::vector<std::vector<std::string>> rows;
  std::vector<std::size_t> emphasised{};  ///< rows in bold
  bool folded = false;                    ///< behind its caption, which opens it
};

/// A plot, drawn twice: for wide windows as it is and for narrow ones with fewer pixels to the same text.
struct PagePlot {
  Plot plot;
  std::string caption;
};

/// 8-bit pixels, one row of the picture for a row of the image.
using Pixels = std::variant<Image<std::uint8_t>, Image<Colour>>;

struct PagePicture {
  Pixels pixels;
  std::string name;         ///< above the picture
  std::string description;  ///< for those who do not see it
};

/// Pictures side by side, as many as fit, and a caption for all.
struct PagePictures {
  std::vector<PagePicture> pictures;
  std::string caption;
};

/// What the colours of pictures mean: a strip of them from left to right, with labels evenly along it.
struct PageScale {
  std::string name;
  Image<Colour> strip;  ///< one row
  std::vector<std::string> labels;
};

struct PageScales {
  std::vector<PageScale> scales;
};

using PageBlock = std::variant<PageHeading, PageParagraph, PageNotice, PageFigures, PageFacts,
                               PageTable, PagePlot, PagePictures, PageScales>;

struct Page {
  std::string title;
  std::string subtitle;
  std::vector<PageBlock> blocks;
};

/// The page as one HTML 5 file without scripts that loads nothing from elsewhere and forbids the browser to: pictures
/// are PNGs within it. Light or dark as the reader's system is; made for windows from 320 pixels wide. It is
/// well-formed XML, too, behind its first line. The same bytes for the same page and version of OpenCV.
///
/// Text is UTF-8 and never markup; what is not UTF-8, and what XML forbids, becomes U+FFFD.
///
/// Throws UsageError for a table without columns or with rows of another length, a picture without pixels or a
/// description, a scale whose strip is not one row, and what svg() refuses. About 4/3 of the PNGs' bytes.
std::string page_html(const Page& page);

}  // namespace sarnerf

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
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

/// A Markdown table, padded so that it reads well as plain text too. Within cells, bars are escaped and line
/// breaks become spaces. Throws UsageError without columns and for a row that does not have one cell a column.
std::string markdown_table(const std::vector<TableColumn>& columns,
                           const std::vector<std::vector<std::string>>& rows);

/// The heading of a section. The page's list of contents has all of them.
struct PageHeading {
  std::string text;
};

struct PageParagraph {
  std::string text;
};

/// A highlighted note or warning.
struct PageNotice {
  enum class Kind { note, warning };
  std::string text;
  Kind kind = Kind::note;
};

/// One figure in large type: {"48.2 dB", "PSNR of the held-out views"}.
struct PageFigure {
  std::string value, meaning;
};

struct PageFigures {
  std::vector<PageFigure> figures;
};

/// A name and its value: {"learning rate", "0.02"}.
struct PageFact {
  std::string name, value;
};

struct PageFacts {
  std::string caption;
  std::vector<PageFact> facts;
};

/// A table. Its first column names the rows. If it is wider than the page, it scrolls separately.
struct PageTable {
  std::string caption;
  std::vector<TableColumn> columns;
  std::vector<std::vector<std::string>> rows;
  std::vector<std::size_t> emphasised{};  ///< rows in bold
  bool folded = false;                    ///< collapsed; a click on the caption opens it
};

/// A plot, drawn twice: unchanged for wide windows, and laid out in fewer pixels for narrow ones.
struct PagePlot {
  Plot plot;
  std::string caption;
};

/// 8-bit pixels. Rows of the picture are rows of the image.
using Pixels = std::variant<Image<std::uint8_t>, Image<Colour>>;

struct PagePicture {
  Pixels pixels;
  std::string name;         ///< above the picture
  std::string description;  ///< alternative text, for readers who cannot see the picture
};

/// Pictures side by side, as many a line as fit, with one caption.
struct PagePictures {
  std::vector<PagePicture> pictures;
  std::string caption;
};

/// A colour scale of pictures: a strip of the colours from left to right, with evenly spaced labels.
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

/// The page as one HTML 5 file without scripts. It loads nothing from elsewhere and forbids the browser to do so; pictures
/// are embedded PNGs. Light or dark as the reader's system is; made for windows from 320 pixels wide. After its first
/// line it is also well-formed XML. The same bytes for the same page and version of OpenCV.
///
/// Text is UTF-8 and never markup. Bytes that are not UTF-8 and characters that XML forbids become U+FFFD.
///
/// Throws UsageError for a table without columns or with rows of another length, a picture without pixels or a
/// description, a scale whose strip is not one row, and plots that svg() refuses. Size: about 4/3 of the PNGs' bytes.
std::string page_html(const Page& page);

/// A page with the contents of a Markdown text, so that a result is written once and read as Markdown or in a browser. Of Markdown it
/// takes what the project's documents have:
///
///     # title                   the first paragraph below it becomes the subtitle
///     ## heading, ### heading
///     | table |                 with its line of alignment; rows whose first cell is bold are emphasised
///     ![description](file)      lines of pictures one below the other stand side by side
///     *one line in italics*     right below a table or pictures: its caption
///     > note
///
/// and paragraphs. Bold, code and links become plain text. `picture` reads a file that the text names; the description is also the
/// picture's name. Throws UsageError for a table without its line of alignment or with rows of another length ("line 12: ..."), and
/// what `picture` throws.
Page page_of_markdown(std::string_view text, const std::function<Pixels(const std::string& file)>& picture);

}  // namespace sarnerf

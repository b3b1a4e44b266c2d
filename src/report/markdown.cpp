// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/report/page.h"

#include <algorithm>
#include <utility>
#include <variant>
#include <vector>

#include "sarnerf/core/error.h"
#include "sarnerf/core/text.h"

namespace sarnerf {

namespace {

std::string trimmed(std::string_view text) {
  const std::size_t first = text.find_first_not_of(" \t\r");
  if (first == std::string_view::npos) return {};
  return std::string(text.substr(first, text.find_last_not_of(" \t\r") - first + 1));
}

/// Without marks of bold, code and links.
std::string plain(std::string_view text) {
  std::string out;
  for (std::size_t n = 0; n < text.size(); ++n) {
    if (text[n] == '\\' && n + 1 < text.size()) {
      out += text[++n];
    } else if (text[n] == '`' || text.substr(n, 2) == "**") {
      n += text[n] == '`' ? 0 : 1;
    } else if (const std::size_t middle = text.find("](", n); text[n] == '[' && middle != std::string_view::npos) {
      const std::size_t end = text.find(')', middle);
      out += plain(text.substr(n + 1, middle - n - 1));
      n = end == std::string_view::npos ? text.size() : end;
    } else {
      out += text[n];
    }
  }
  return out;
}

/// The cells of "| a | b |", as they are written.
std::vector<std::string> cells_of(const std::string& line) {
  std::vector<std::string> cells{""};
  for (std::size_t n = 1; n < line.size(); ++n) {
    if (line[n] == '\\' && n + 1 < line.size() && line[n + 1] == '|') {
      cells.back() += line[++n];
    } else if (line[n] == '|') {
      cells.emplace_back();
    } else {
      cells.back() += line[n];
    }
  }
  if (trimmed(cells.back()).empty()) cells.pop_back();
  for (std::string& cell : cells) cell = trimmed(cell);
  return cells;
}

class Reader {
 public:
  Reader(std::string_view text, const std::function<Pixels(const std::string&)>& picture) : picture_(picture) {
    for (std::size_t begin = 0; begin <= text.size();) {
      const std::size_t end = std::min(text.find('\n', begin), text.size());
      lines_.push_back(trimmed(text.substr(begin, end - begin)));
      begin = end + 1;
    }
  }

  Page page() {
    while (next_ < lines_.size()) {
      const std::string& line = lines_[next_];
      if (line.empty()) ++next_;
      else if (line.starts_with("# ") && page_.title.empty()) page_.title = plain(lines_[next_++].substr(2));
      else if (line.starts_with("#")) add_heading();
      else if (line.starts_with("|")) add_table();
      else if (line.starts_with("![")) add_pictures();
      else if (is_caption(line) && caption() != nullptr) *caption() = plain(line.substr(1, line.size() - 2)), ++next_;
      else if (line.starts_with(">")) page_.blocks.emplace_back(PageNotice{paragraph(">")});
      else if (page_.subtitle.empty() && page_.blocks.empty()) page_.subtitle = paragraph("");
      else page_.blocks.emplace_back(PageParagraph{paragraph("")});
    }
    return std::move(page_);
  }

 private:
  static bool is_caption(const std::string& line) {
    return line.size() > 2 && line.front() == '*' && line.back() == '*' && line[1] != '*';
  }

  /// The caption of the last block, if that may have one and has none yet.
  std::string* caption() {
    if (page_.blocks.empty()) return nullptr;
    std::string* found = nullptr;
    if (auto* table = std::get_if<PageTable>(&page_.blocks.back())) found = &table->caption;
    if (auto* pictures = std::get_if<PagePictures>(&page_.blocks.back())) found = &pictures->caption;
    return found != nullptr && found->empty() ? found : nullptr;
  }

  void add_heading() {
    const std::string& line = lines_[next_++];
    page_.blocks.emplace_back(PageHeading{plain(trimmed(line.substr(line.find_first_not_of('#'))))});
  }

  /// Consecutive lines that begin with `mark` and are nothing else.
  std::string paragraph(const std::string& mark) {
    std::string text;
    for (; next_ < lines_.size(); ++next_) {
      const std::string& line = lines_[next_];
      if (line.empty() || !line.starts_with(mark)) break;
      if (mark.empty() && !text.empty() && (line[0] == '#' || line[0] == '|' || line[0] == '>' || line.starts_with("!["))) break;
      text += (text.empty() ? "" : " ") + plain(trimmed(line.substr(mark.size())));
    }
    return text;
  }

  void add_pictures() {
    PagePictures pictures;
    for (; next_ < lines_.size() && lines_[next_].starts_with("!["); ++next_) {
      const std::string& line = lines_[next_];
      const std::size_t middle = line.find("](");
      if (middle == std::string::npos || line.back() != ')')
        throw UsageError(format("line %zu: expected a picture, ![description](file), found '%s'", next_ + 1, line.c_str()));
      const std::string description = plain(line.substr(2, middle - 2));
      pictures.pictures.push_back({picture_(line.substr(middle + 2, line.size() - middle - 3)), description, description});
    }
    page_.blocks.emplace_back(std::move(pictures));
  }

  void add_table() {
    PageTable table;
    const std::vector<std::string> headings = cells_of(lines_[next_++]);
    if (next_ == lines_.size() || lines_[next_].find_first_not_of("|-: ") != std::string::npos || !lines_[next_].starts_with("|"))
      throw UsageError(format("line %zu: expected a table's line of alignment, such as |---|--:|", next_ + 1));
    const std::vector<std::string> rule = cells_of(lines_[next_++]);
    if (rule.size() != headings.size())
      throw UsageError(format("line %zu: expected %zu columns, as many as headings, found %zu", next_, headings.size(), rule.size()));
    for (std::size_t c = 0; c < headings.size(); ++c)
      table.columns.push_back({plain(headings[c]), rule[c].ends_with(':') ? Align::right : Align::left});
    for (; next_ < lines_.size() && lines_[next_].starts_with("|"); ++next_) {
      std::vector<std::string> row = cells_of(lines_[next_]);
      row.resize(std::max(row.size(), headings.size()));
      if (row.size() > headings.size())
        throw UsageError(format("line %zu: expected %zu cells, found %zu", next_ + 1, headings.size(), row.size()));
      if (row[0].starts_with("**")) table.emphasised.push_back(table.rows.size());
      for (std::string& cell : row) cell = plain(cell);
      table.rows.push_back(std::move(row));
    }
    page_.blocks.emplace_back(std::move(table));
  }

  const std::function<Pixels(const std::string&)>& picture_;
  std::vector<std::string> lines_;
  std::size_t next_ = 0;
  Page page_;
};

}  // namespace

Page page_of_markdown(std::string_view text, const std::function<Pixels(const std::string& file)>& picture) {
  return Reader(text, picture).page();
}

}  // namespace sarnerf

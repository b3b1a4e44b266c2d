// SPDX-License-Identifier: Apache-2.0
#include "flat_toml.h"

#include <algorithm>
#include <charconv>
#include <iterator>
#include <optional>
#include <toml++/toml.h>

#include "sarnerf/core/error.h"
#include "sarnerf/core/input_text.h"

namespace sarnerf::app {
namespace {

std::string place(const std::string& file, const toml::source_region& source) {
  return file + ":" + std::to_string(source.begin.line) + ": ";
}

/// A value as it would stand on the command line; nothing for dates and tables.
std::optional<std::string> text_of(const toml::node& node) {
  if (const auto* text = node.as_string()) return text->get();
  if (const auto* flag = node.as_boolean()) return flag->get() ? "true" : "false";
  char digits[40];
  std::to_chars_result end{digits, {}};
  if (const auto* whole = node.as_integer()) {
    end = std::to_chars(digits, digits + sizeof digits, whole->get());
  } else if (const auto* number = node.as_floating_point()) {
    end = std::to_chars(digits, digits + sizeof digits, number->get());
  } else {
    return std::nullopt;
  }
  return std::string(digits, end.ptr);
}

std::string value_text(const toml::node& node, const std::string& name, const std::string& file) {
  if (const auto text = text_of(node)) return *text;
  throw InputError(place(file, node.source()) + in_quotes(name) +
                   ": expected a number, true, false or a text in quotes, found a " +
                   (node.is_table() ? "table" : node.is_array() ? "list" : "date or time"));
}

FlatItem item_of(const std::string& name, const toml::node& node, const std::string& file) {
  FlatItem item;
  item.name = name;
  item.line = static_cast<int>(node.source().begin.line);
  if (node.is_table()) {
    throw InputError(place(file, node.source()) + "expected name = value, found the section [" + in_one_line(name, 60) +
                     "]: there are no sections");
  }
  const toml::array* list = node.as_array();
  if (list == nullptr) {
    item.values.push_back(value_text(node, name, file));
    return item;
  }
  for (const toml::node& element : *list) item.values.push_back(value_text(element, name, file));
  if (item.values.empty()) {
    throw InputError(place(file, node.source()) + in_quotes(name) + " is an empty list: leave the line out, or give a value");
  }
  return item;
}

/// A line of the file, in quotes.
std::string line_of(std::string_view text, toml::source_index number) {
  for (; number > 1; --number) {
    const auto end = text.find('\n');
    if (end == std::string_view::npos) return in_quotes({});
    text.remove_prefix(end + 1);
  }
  std::string line(text.substr(0, text.find('\n')));
  if (!line.empty() && line.back() == '\r') line.pop_back();
  return in_quotes(line);
}

/// The library's reason without its account of what it was doing.
std::string reason(std::string_view description) {
  if (description.starts_with("Error while parsing")) {
    if (const auto colon = description.find(": "); colon != std::string_view::npos) {
      description.remove_prefix(colon + 2);
    }
  }
  return in_one_line(description, 200);
}

/// Each part of a dotted name is a table within another one, and toml++ frees them by one call a level: a file of
/// some tens of kilobytes exhausts the stack. Flat files need no such names, and numbers have few dots.
void require_shallow(std::string_view text, const std::string& file) {
  constexpr std::ptrdiff_t kMostDots = 4096;
  const std::ptrdiff_t n_dots = std::count(text.begin(), text.end(), '.');
  if (n_dots <= kMostDots) return;
  throw InputError(file + ": expected a few lines of name = value, found " + std::to_string(n_dots) +
                   " dots, more than " + std::to_string(kMostDots) + "; the file is meant for something else");
}

toml::table parse(std::string_view text, const std::string& file) {
  try {
    return toml::parse(text, file);
  } catch (const toml::parse_error& e) {
    const std::string why = reason(e.description());
    if (why.starts_with("cannot redefine")) {
      throw InputError(place(file, e.source()) + "the name in " + line_of(text, e.source().begin.line) +
                       " stands twice; keep one of the lines");
    }
    throw InputError(place(file, e.source()) + "expected name = value, such as pitch = 45, with texts in quotes "
                     "as size = \"128x128\"; found " + line_of(text, e.source().begin.line) + " (" + why + ")");
  }
}

}  // namespace

std::vector<FlatItem> read_flat_toml(std::istream& input, const std::string& file) {
  const std::string text{std::istreambuf_iterator<char>(input), {}};
  require_shallow(text, file);
  const toml::table table = parse(text, file);
  std::vector<FlatItem> items;
  for (const auto& [name, node] : table) items.push_back(item_of(std::string(name.str()), node, file));
  return items;
}

}  // namespace sarnerf::app

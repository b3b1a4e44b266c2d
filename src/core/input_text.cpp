// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/core/input_text.h"

#include <algorithm>
#include <cstddef>

#include "sarnerf/core/error.h"

namespace sarnerf {
namespace {

bool is_control(char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7f; }

}  // namespace

std::string_view without_byte_order_mark(std::string_view text, const std::string& where) {
  if (text.starts_with("\xef\xbb\xbf")) return text.substr(3);
  // Without a mark, every other byte of mostly English text is zero.
  constexpr std::string_view kPattern[] = {std::string_view("\xff\xfe", 2), std::string_view("\xfe\xff", 2),
                                           std::string_view("\0\0\xfe\xff", 4)};
  bool wide = text.size() >= 4 && ((text[0] == '\0') != (text[1] == '\0')) && (text[0] == '\0') == (text[2] == '\0') &&
              (text[1] == '\0') == (text[3] == '\0');
  for (const std::string_view mark : kPattern) wide = wide || text.starts_with(mark);
  if (wide) {
    throw InputError(where + ": expected text in ASCII or UTF-8, found UTF-16 or UTF-32; save it as UTF-8");
  }
  return text;
}

void require_shallow_json(std::string_view text, const std::string& where) {
  int depth = 0;
  std::size_t line = 1;
  bool in_string = false;
  for (std::size_t n = 0; n < text.size(); ++n) {
    const char c = text[n];
    if (c == '\n') ++line;
    if (in_string) {
      if (c == '\\') ++n;
      if (c == '"') in_string = false;
    } else if (c == '"') {
      in_string = true;
    } else if (c == '[' || c == '{') {
      if (++depth > kDeepestJson) {
        throw InputError(where + ":" + std::to_string(line) + ": expected at most " +
                         std::to_string(kDeepestJson) +
                         " arrays and objects within one another, found more; the file is damaged or "
                         "meant for something else");
      }
    } else if (c == ']' || c == '}') {
      --depth;
    }
  }
}

bool has_control_characters(std::string_view text) { return std::any_of(text.begin(), text.end(), is_control); }

std::string in_one_line(std::string_view text, std::size_t most_bytes) {
  std::size_t end = text.size();
  if (end > most_bytes) {
    // Bytes 10xxxxxx continue a character; four bytes are the longest one.
    const auto continues = [&](std::size_t n) { return (static_cast<unsigned char>(text[n]) & 0xc0) == 0x80; };
    end = most_bytes;
    while (end > 0 && most_bytes - end < 3 && continues(end)) --end;
  }
  std::string line(text.substr(0, end));
  std::replace_if(line.begin(), line.end(), is_control, '?');
  return end < text.size() ? line + "…" : line;
}

std::string in_quotes(std::string_view text) {
  constexpr std::size_t kLongest = 60;
  return "'" + in_one_line(text, kLongest) + "'";
}

}  // namespace sarnerf

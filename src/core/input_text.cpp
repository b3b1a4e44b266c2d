// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/core/input_text.h"

#include <cstddef>

#include "sarnerf/core/error.h"

namespace sarnerf {

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

}  // namespace sarnerf

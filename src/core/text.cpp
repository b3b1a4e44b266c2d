// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/core/text.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cstdarg>
#include <cstddef>
#include <cstdio>
#include <numeric>
#include <vector>

#include "sarnerf/core/error.h"

namespace sarnerf {

std::string format(const char* pattern, ...) {
  std::va_list arguments, again;
  va_start(arguments, pattern);
  va_copy(again, arguments);
  const int length = std::vsnprintf(nullptr, 0, pattern, arguments);
  std::string text(static_cast<std::size_t>(std::max(0, length)), '\0');
  std::vsnprintf(text.data(), text.size() + 1, pattern, again);
  va_end(again);
  va_end(arguments);
  return text;
}

std::string with_thousands(std::uint64_t count) {
  std::string digits = std::to_string(count);
  for (std::size_t n = digits.size(); n > 3; n -= 3) digits.insert(n - 3, ",");
  return digits;
}

std::string counted(std::uint64_t count, std::string_view singular, std::string_view plural) {
  std::string text = with_thousands(count) + " ";
  if (count == 1) return text.append(singular);
  return plural.empty() ? text.append(singular).append("s") : text.append(plural);
}

namespace {

char lower(char c) { return static_cast<char>(std::tolower(static_cast<unsigned char>(c))); }

/// Number of insertions, deletions and replacements that turn a into b, ignoring case.
std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 0; i < a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i + 1;
    for (std::size_t j = 0; j < b.size(); ++j) {
      const std::size_t replaced = diagonal + (lower(a[i]) == lower(b[j]) ? 0 : 1);
      diagonal = row[j + 1];
      row[j + 1] = std::min({replaced, row[j] + 1, row[j + 1] + 1});
    }
  }
  return row.back();
}

}  // namespace

std::string closest_name(std::string_view name, std::span<const std::string> names) {
  // A name with more than two in five letters wrong is a different word.
  constexpr std::size_t kLongest = 64;
  if (name.size() > kLongest) return {};
  std::size_t fewest = name.size() * 2 / 5 + 1;
  std::string closest;
  for (const std::string& candidate : names) {
    if (candidate.size() > kLongest) continue;
    // A name cut short counts as one wrong letter.
    const bool begins = name.size() > 2 && candidate.starts_with(name);
    const std::size_t distance = begins ? 1 : edit_distance(name, candidate);
    if (distance < fewest) {
      fewest = distance;
      closest = candidate;
    }
  }
  return closest;
}

namespace {

bool is_control(char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7f; }

}  // namespace

std::string_view without_byte_order_mark(std::string_view text, const std::string& where) {
  if (text.starts_with("\xef\xbb\xbf")) return text.substr(3);
  // Mostly English text in UTF-16 has a zero in every other byte; this detects it without a mark.
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
    // Bytes 10xxxxxx continue a character, which has at most four bytes.
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

std::string human_bytes(std::uint64_t bytes) {
  constexpr std::array kUnits = {"B", "kB", "MB", "GB", "TB"};
  double value = static_cast<double>(bytes);
  std::size_t unit = 0;
  while (value >= 999.5 && unit + 1 < kUnits.size()) {
    value /= 1000.0;
    ++unit;
  }
  std::array<char, 32> text;
  std::snprintf(text.data(), text.size(), "%.3g %s", value, kUnits[unit]);
  return text.data();
}

std::string number_text(double value) {
  std::array<char, 32> text;
  return {text.data(), std::to_chars(text.data(), text.data() + text.size(), value).ptr};
}

std::string listed(std::span<const std::string> names, std::size_t limit) {
  std::string text;
  for (std::size_t n = 0; n < std::min(names.size(), limit); ++n) {
    if (n > 0) text += ", ";
    text += in_one_line(names[n], 60);
  }
  if (names.size() > limit) text += " … (" + with_thousands(names.size() - limit) + " more)";
  return text;
}

}  // namespace sarnerf

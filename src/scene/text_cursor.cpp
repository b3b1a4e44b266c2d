// SPDX-License-Identifier: Apache-2.0
#include "text_cursor.h"

#include <charconv>
#include <cstring>
#include <limits>

namespace sarnerf {
namespace {

bool is_blank(char c) {
  return c == ' ' || c == '\t' || c == '\r' || c == '\n' || c == '\v' || c == '\f';
}

char first_line_end(std::string_view text) {
  const std::size_t first = text.find_first_of("\r\n");
  if (first == std::string_view::npos || text[first] == '\n') return '\n';
  // Text converted twice ends its lines by "\r\r\n".
  const std::size_t behind = text.find_first_not_of('\r', first);
  return behind != std::string_view::npos && text[behind] == '\n' ? '\n' : '\r';
}

/// from_chars takes no leading plus.
std::string_view without_plus(std::string_view token) {
  if (token.size() > 1 && token[0] == '+' && token[1] != '-' && token[1] != '+') {
    token.remove_prefix(1);
  }
  return token;
}

}  // namespace

std::string_view take_token(std::string_view& rest) {
  std::size_t begin = 0;
  while (begin < rest.size() && is_blank(rest[begin])) ++begin;
  std::size_t end = begin;
  while (end < rest.size() && !is_blank(rest[end])) ++end;
  const std::string_view token = rest.substr(begin, end - begin);
  rest.remove_prefix(end);
  return token;
}

std::optional<double> parse_real(std::string_view token) {
  token = without_plus(token);
  double value = 0.0;
  const char* end = token.data() + token.size();
  const auto result = std::from_chars(token.data(), end, value);
  if (token.empty() || result.ptr != end) return std::nullopt;
  if (result.ec == std::errc::result_out_of_range) {
    const std::size_t exponent = token.find_first_of("eE");
    const bool tiny = exponent != std::string_view::npos && token.substr(exponent + 1, 1) == "-";
    return tiny ? 0.0 : std::numeric_limits<double>::infinity();
  }
  if (result.ec != std::errc()) return std::nullopt;
  return value;
}

std::optional<std::int64_t> parse_integer(std::string_view token) {
  token = without_plus(token);
  std::int64_t value = 0;
  const char* end = token.data() + token.size();
  const auto result = std::from_chars(token.data(), end, value);
  if (token.empty() || result.ptr != end || result.ec != std::errc()) return std::nullopt;
  return value;
}

TextCursor::TextCursor(std::string_view text) : text_(text), line_end_(first_line_end(text)) {}

bool TextCursor::next_line(std::string_view& line) {
  if (position_ >= text_.size()) return false;
  if (!in_line_) ++line_number_;
  in_line_ = false;
  const std::string_view rest = text_.substr(position_);
  const void* found = std::memchr(rest.data(), line_end_, rest.size());
  const std::size_t length =
      found ? static_cast<std::size_t>(static_cast<const char*>(found) - rest.data()) : rest.size();
  line = rest.substr(0, length);
  position_ += found ? length + 1 : length;
  while (!line.empty() && line.back() == '\r') line.remove_suffix(1);
  return true;
}

std::string_view TextCursor::next_token() {
  while (position_ < text_.size()) {
    if (!in_line_) {
      ++line_number_;
      in_line_ = true;
    }
    const char c = text_[position_];
    if (c == line_end_) {
      in_line_ = false;
      ++position_;
    } else if (is_blank(c)) {
      ++position_;
    } else {
      const std::size_t begin = position_;
      while (position_ < text_.size() && text_[position_] != line_end_ && !is_blank(text_[position_])) {
        ++position_;
      }
      return text_.substr(begin, position_ - begin);
    }
  }
  return {};
}

}  // namespace sarnerf

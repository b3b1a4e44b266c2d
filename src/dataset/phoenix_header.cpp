// SPDX-License-Identifier: Apache-2.0
#include "phoenix_header.h"

#include <algorithm>
#include <charconv>
#include <cmath>

#include "sarnerf/core/error.h"
#include "sarnerf/core/input_text.h"
#include "sarnerf/dataset/phoenix.h"

namespace sarnerf {
namespace {

constexpr std::string_view kBegin = "[PhoenixHeaderVer";
constexpr std::string_view kEnd = "[EndofPhoenixHeader]";

/// Real headers have two thousand bytes; in a megabyte without an end there is none.
constexpr std::size_t kMostBytes = 1 << 20;

std::string_view trimmed(std::string_view text) {
  const auto begin = text.find_first_not_of(" \t\r");
  if (begin == std::string_view::npos) return {};
  return text.substr(begin, text.find_last_not_of(" \t\r") - begin + 1);
}

}  // namespace

bool begins_as_phoenix(std::string_view text) {
  const std::size_t begin = std::min(text.find_first_not_of("\r\n"), text.size());
  return begin <= kPhoenixHeadBytes - kBegin.size() && text.substr(begin).starts_with(kBegin);
}

PhoenixHeader::PhoenixHeader(std::string_view file, std::string where) : where_(std::move(where)) {
  if (!begins_as_phoenix(file))
    fail("expected a Phoenix file, which begins with " + std::string(kBegin) + "…]");
  const std::string_view head = file.substr(0, kMostBytes);
  const std::size_t end = head.find(kEnd);
  if (end == std::string_view::npos)
    fail("the header has no end, expected " + std::string(kEnd) +
         "; the file is cut off or damaged");
  size_ = end + kEnd.size();
  if (size_ < file.size() && file[size_] == '\n') ++size_;

  for (std::size_t at = 0; at < end;) {
    const std::size_t line_end = std::min(head.find('\n', at), end);
    const std::string_view line = head.substr(at, line_end - at);
    if (const std::size_t equals = line.find('='); equals != std::string_view::npos)
      fields_.emplace(trimmed(line.substr(0, equals)), trimmed(line.substr(equals + 1)));
    at = line_end + 1;
  }
}

std::string PhoenixHeader::text(std::string_view name) const {
  const auto found = fields_.find(name);
  return found == fields_.end() ? std::string() : in_one_line(found->second, 60);
}

std::optional<double> PhoenixHeader::number(std::string_view name) const {
  const auto found = fields_.find(name);
  if (found == fields_.end() || found->second.empty()) return std::nullopt;
  const std::string& value = found->second;
  double result = 0.0;
  const auto [rest, error] = std::from_chars(value.data(), value.data() + value.size(), result);
  if (error != std::errc() || rest != value.data() + value.size() || !std::isfinite(result))
    fail(std::string(name) + ": expected a number, found " + in_quotes(value));
  return result;
}

double PhoenixHeader::positive_number(std::string_view name) const {
  const auto value = number(name);
  if (!value) fail("the header has no " + std::string(name));
  if (!(*value > 0.0)) fail(std::string(name) + ": expected a number above 0, found " + text(name));
  return *value;
}

std::size_t PhoenixHeader::whole_number(std::string_view name, std::size_t least,
                                        std::size_t most) const {
  const auto value = number(name);
  if (!value) fail("the header has no " + std::string(name));
  if (*value != std::floor(*value) || *value < static_cast<double>(least) ||
      *value > static_cast<double>(most))
    fail(std::string(name) + ": expected a whole number from " + std::to_string(least) + " to " +
         std::to_string(most) + ", found " + text(name));
  return static_cast<std::size_t>(*value);
}

void PhoenixHeader::fail(const std::string& what) const { throw InputError(where_ + ": " + what); }

}  // namespace sarnerf

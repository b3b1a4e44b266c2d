// SPDX-License-Identifier: Apache-2.0
#include "values.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <iterator>
#include <optional>
#include <sstream>

#include <toml++/toml.h>

#include "sarnerf/core/error.h"
#include "sarnerf/core/text.h"
#include "sarnerf/core/units.h"

namespace sarnerf::app {

namespace {

/// A list of more angles is taken for a misplaced decimal point.
constexpr double kMaxAngles = 1e6;
constexpr int kMaxPixels = 65535;

[[noreturn]] void fail(std::string_view option, std::string_view expected, std::string_view found) {
  throw UsageError(std::string(option) + ": expected " + std::string(expected) + ", found '" +
                   std::string(found) + "'");
}

std::optional<double> to_number(std::string_view text) {
  // from_chars does not accept a plus sign.
  if (text.starts_with('+')) text.remove_prefix(1);
  double value = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(value)) return {};
  return value;
}

std::vector<std::string_view> split(std::string_view text, std::string_view separators) {
  std::vector<std::string_view> parts;
  while (true) {
    const auto end = text.find_first_of(separators);
    parts.push_back(text.substr(0, end));
    if (end == std::string_view::npos) return parts;
    text.remove_prefix(end + 1);
  }
}

/// Steps such as 0.1 are not binary fractions: rounds to the decimal number that is meant.
double without_rounding_noise(double angle_deg) { return std::round(angle_deg * 1e9) / 1e9; }

}  // namespace

double parse_number(std::string_view option, std::string_view text) {
  const auto value = to_number(text);
  if (!value) fail(option, "a number", text);
  return *value;
}

double parse_positive(std::string_view option, std::string_view text) {
  const auto value = to_number(text);
  if (!value || !(*value > 0.0)) fail(option, "a number above zero", text);
  return *value;
}

double parse_between(std::string_view option, std::string_view text, double least, double most) {
  const auto value = to_number(text);
  if (value && *value >= least && *value <= most) return *value;
  char limits[80];
  std::snprintf(limits, sizeof limits, "a number from %.10g to %.10g", least, most);
  fail(option, limits, text);
}

double parse_part(std::string_view option, std::string_view text, double least, double most) {
  const bool percent = !text.empty() && text.back() == '%';
  const double value = parse_number(option, percent ? text.substr(0, text.size() - 1) : text) * (percent ? 0.01 : 1.0);
  if (value >= least && value <= most) return value;
  char expected[160];
  std::snprintf(expected, sizeof expected, ": expected %.10g%% to %.10g%% (or %.10g to %.10g), found ", 100.0 * least,
                100.0 * most, least, most);
  throw UsageError(std::string(option) + expected + std::string(text));
}

std::int64_t parse_whole(std::string_view option, std::string_view text, std::int64_t least,
                         std::int64_t most) {
  std::int64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || value < least || value > most) {
    fail(option, "a whole number from " + std::to_string(least) + " to " + std::to_string(most), text);
  }
  return value;
}

std::vector<double> parse_angles_deg(std::string_view option, std::string_view text) {
  constexpr double kMostTurned = 36000.0;  // larger angles lose digits
  constexpr std::string_view kExpected =
      "degrees: a number, a range first:last:step such as 0:350:10, or a list of both such as 15,17,30";
  std::vector<double> angles;
  for (const std::string_view item : split(text, ",")) {
    std::array<double, 3> parts{};
    const auto texts = split(item, ":");
    if (texts.size() != 1 && texts.size() != 3) fail(option, kExpected, text);
    for (std::size_t n = 0; n < texts.size(); ++n) {
      const auto value = to_number(texts[n]);
      if (!value) fail(option, kExpected, text);
      if (!(std::abs(*value) <= kMostTurned)) fail(option, "angles within a hundred turns", item);
      parts[n] = *value;
    }
    if (texts.size() == 1) {
      angles.push_back(parts[0]);
      continue;
    }
    const auto [first, last, step] = parts;
    const double n_steps = (last - first) / step;
    if (step == 0.0 || !(n_steps >= 0.0)) {
      fail(option, "a range first:last:step whose step leads from first to last", item);
    }
    if (n_steps + double(angles.size()) > kMaxAngles) fail(option, "at most a million angles", item);
    // If the step does not divide the range, the list ends before `last`. The tolerance keeps rounding from ending it
    // too early.
    const auto n_last = static_cast<long>(std::floor(n_steps + 1e-9));
    for (long n = 0; n <= n_last; ++n) {
      angles.push_back(without_rounding_noise(first + double(n) * step));
    }
  }
  return angles;
}

std::string unmet_end(std::string_view option, std::string_view text) {
  for (const std::string_view item : split(text, ",")) {
    const auto texts = split(item, ":");
    if (texts.size() != 3) continue;
    const double last = parse_angles_deg(option, item).back();
    if (without_rounding_noise(*to_number(texts[1])) == last) continue;
    char stop[40];
    std::snprintf(stop, sizeof stop, "%.10g", last);
    return std::string(option) + " " + std::string(item) + " stops at " + stop + ": its step does not reach " +
           std::string(texts[1]);
  }
  return {};
}

std::pair<int, int> parse_image_size(std::string_view option, std::string_view text) {
  constexpr std::string_view kExpected =
      "a size in pixels, azimuth x range, from 1 to 65535 a side, such as 128x128";
  const auto parts = split(text, "xX,");
  std::array<int, 2> size{};
  if (parts.size() > 2) fail(option, kExpected, text);
  for (std::size_t n = 0; n < parts.size(); ++n) {
    const auto value = to_number(parts[n]);
    if (!value || *value != std::floor(*value) || *value < 1 || *value > kMaxPixels) {
      fail(option, kExpected, text);
    }
    size[n] = static_cast<int>(*value);
  }
  return {size[0], parts.size() == 2 ? size[1] : size[0]};
}

std::pair<double, double> parse_spacing_m(std::string_view option, std::string_view text) {
  const auto parts = split(text, ",");
  std::array<double, 2> spacing{};
  for (std::size_t n = 0; n < parts.size(); ++n) {
    const auto value = to_number(parts[n]);
    if (parts.size() > 2 || !value || !(*value > 0.0)) {
      fail(option, "metres above zero, azimuth and range, such as 0.3 or 0.3,0.2", text);
    }
    spacing[n] = *value;
  }
  return {spacing[0], parts.size() == 2 ? spacing[1] : spacing[0]};
}

glm::dvec3 parse_vector(std::string_view option, std::string_view text) {
  const auto parts = split(text, ",");
  glm::dvec3 vector(0.0);
  for (std::size_t n = 0; n < 3; ++n) {
    const auto value = parts.size() == 3 ? to_number(parts[n]) : std::nullopt;
    if (!value || std::abs(*value) > kFarthestRadar_m) fail(option, "x,y,z in metres, at most 1e9, such as 0,1.5,-20", text);
    vector[static_cast<int>(n)] = *value;
  }
  return vector;
}

double parse_units_m(std::string_view option, std::string_view text) {
  if (const auto metres = metres_of_unit(text)) return *metres;
  const auto value = to_number(text);
  if (!value || !(*value > 0.0)) {
    fail(option, std::string(kUnitsOfLength) + ", or the metres of one unit as a number", text);
  }
  return *value;
}

std::uint64_t parse_bytes(std::string_view option, std::string_view text) {
  constexpr std::string_view kPrefixes = "KMGT";
  std::string_view number = text;
  for (const std::string_view suffix : {"iB", "B"}) {
    if (number.ends_with(suffix)) {
      number.remove_suffix(suffix.size());
      break;
    }
  }
  double factor = 1.0;
  if (!number.empty()) {
    const char last = number.back() == 'k' ? 'K' : number.back();
    if (const auto power = kPrefixes.find(last); power != std::string_view::npos) {
      factor = std::pow(1024.0, double(power) + 1.0);
      number.remove_suffix(1);
    }
  }
  const auto value = to_number(number);
  if (!value || !(*value * factor >= 1.0) || *value * factor > 1e18) {
    fail(option, "a size such as 8G, 500M or 1.5G", text);
  }
  return static_cast<std::uint64_t>(*value * factor);
}

double parse_seconds(std::string_view option, std::string_view text) {
  constexpr double kMost_s = 1e9;
  std::string_view digits = text;
  double unit_s = 1.0;
  if (!digits.empty()) {
    switch (digits.back()) {
      case 's': digits.remove_suffix(1); break;
      case 'm': digits.remove_suffix(1); unit_s = 60.0; break;
      case 'h': digits.remove_suffix(1); unit_s = 3600.0; break;
      default: break;
    }
  }
  const auto value = to_number(digits);
  if (!value || !(*value > 0.0) || *value * unit_s > kMost_s) fail(option, "a time such as 90s, 2m or 1h", text);
  return *value * unit_s;
}

std::string bytes_text(std::uint64_t bytes) {
  constexpr const char* kUnits[] = {"B", "KiB", "MiB", "GiB", "TiB"};
  double value = double(bytes);
  std::size_t unit = 0;
  while (value >= 1000.0 && unit < 4) {
    value /= 1024.0;
    ++unit;
  }
  char text[40];
  std::snprintf(text, sizeof text, "%.3g %s", value, kUnits[unit]);
  return text;
}

std::vector<double> incidences_deg(const std::string& pitch_text,
                                   const std::string& depression_text) {
  const auto check = [](const char* option, double angle_deg) {
    if (angle_deg > 0.0 && angle_deg < 90.0) return;
    char text[120];
    std::snprintf(text, sizeof text,
                  "%s: expected degrees between 0 and 90, both excluded, found %.10g", option,
                  angle_deg);
    throw UsageError(text);
  };
  std::vector<double> pitch, depression;
  if (!pitch_text.empty()) pitch = parse_angles_deg("--pitch", pitch_text);
  if (!depression_text.empty()) depression = parse_angles_deg("--depression", depression_text);
  for (const double angle : pitch) check("--pitch", angle);
  for (double& angle : depression) {
    check("--depression", angle);
    angle = 90.0 - angle;
  }
  if (!pitch.empty() && !depression.empty() && pitch != depression) {
    throw UsageError("--pitch " + pitch_text + " and --depression " + depression_text +
                     " contradict each other: depression is 90 - pitch; give one of them");
  }
  return pitch.empty() ? depression : pitch;
}

namespace {

std::string shown(const std::string& value) { return value; }
std::string shown(const std::filesystem::path& value) { return value.string(); }
std::string shown(double value) { return format("%.10g", value); }
std::string shown(std::int64_t value) { return std::to_string(value); }

std::string shown(const std::vector<double>& values) {
  std::string list;
  for (const double value : values) {
    if (!list.empty()) list += ',';
    list += shown(value);
  }
  return list;
}

std::string shown(const glm::dvec3& point) { return shown(std::vector{point.x, point.y, point.z}); }
std::string shown(const std::pair<int, int>& size) { return std::to_string(size.first) + "x" + std::to_string(size.second); }

/// One number if both are equal, which the option accepts too.
std::string shown(const std::pair<double, double>& both) {
  const std::string first = shown(both.first);
  return both.first == both.second ? first : first + ',' + shown(both.second);
}

template <class T, class Read>
Kind<T> kind(std::string type, Read read) {
  return {std::move(type), std::move(read), [](const T& value) { return shown(value); }};
}

std::string as_given(std::string_view, std::string_view text) { return std::string(text); }

}  // namespace

Kind<std::string> text(std::string type) { return kind<std::string>(std::move(type), as_given); }
Kind<std::filesystem::path> path(std::string type) { return kind<std::filesystem::path>(std::move(type), as_given); }
Kind<double> number(std::string type) { return kind<double>(std::move(type), parse_number); }
Kind<double> positive(std::string type) { return kind<double>(std::move(type), parse_positive); }

Kind<double> between(std::string type, double least, double most) {
  return kind<double>(std::move(type), [=](auto& option, auto& text) { return parse_between(option, text, least, most); });
}

Kind<double> part(std::string type, double least, double most) {
  return kind<double>(std::move(type), [=](auto& option, auto& text) { return parse_part(option, text, least, most); });
}

Kind<std::int64_t> whole(std::string type, std::int64_t least, std::int64_t most) {
  return kind<std::int64_t>(std::move(type), [=](auto& option, auto& text) { return parse_whole(option, text, least, most); });
}

Kind<std::vector<double>> angles_deg() { return kind<std::vector<double>>("DEG", parse_angles_deg); }
Kind<std::pair<int, int>> image_size() { return kind<std::pair<int, int>>("AxR", parse_image_size); }
Kind<std::pair<double, double>> spacing_m() { return kind<std::pair<double, double>>("A[,R]", parse_spacing_m); }
std::vector<std::string> parts_of(const std::string& list) {
  std::vector<std::string> parts;
  std::istringstream stream(list);
  for (std::string part; std::getline(stream, part, ',');) parts.push_back(part);
  return parts;
}

Kind<double> code_value() {
  const auto read = [](const std::string& option, const std::string& text) {
    const std::size_t slash = text.find('/');
    if (slash == std::string::npos) return parse_positive(option, text);
    return parse_positive(option, text.substr(0, slash)) / parse_positive(option, text.substr(slash + 1));
  };
  return {"X|X/Y", read, [](double) { return std::string("1"); }};
}
Kind<glm::dvec3> point_m() { return kind<glm::dvec3>("X,Y,Z", parse_vector); }
Kind<double> seconds() { return kind<double>("TIME", parse_seconds); }

Kind<double> units_m() {
  return {"UNIT", parse_units_m, [](double metres) { return metres == 1.0 ? "m" : shown(metres); }};
}

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

/// The library's reason without its prefix "Error while parsing ...: ".
std::string reason(std::string_view description) {
  if (description.starts_with("Error while parsing")) {
    if (const auto colon = description.find(": "); colon != std::string_view::npos) {
      description.remove_prefix(colon + 2);
    }
  }
  return in_one_line(description, 200);
}

/// Each part of a dotted name is a table within another one, and toml++ frees nested tables recursively: a file of
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
                       " is given twice; keep one of the lines");
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

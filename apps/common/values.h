// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <istream>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include <glm/glm.hpp>

namespace sarnerf::app {

// These functions convert texts of the command line to values. Each throws UsageError with the option's name, what
// was expected (with an example), and what was found.

/// A finite number.
double parse_number(std::string_view option, std::string_view text);

/// A finite number above zero.
double parse_positive(std::string_view option, std::string_view text);

/// A number between two limits, both allowed.
double parse_between(std::string_view option, std::string_view text, double least, double most);

/// A fraction: "0.01" or "1%", between two limits, both allowed.
double parse_part(std::string_view option, std::string_view text, double least, double most);

/// A whole number from `least` to `most`.
std::int64_t parse_whole(std::string_view option, std::string_view text, std::int64_t least,
                         std::int64_t most);

/// Angles (deg): numbers and ranges first:last:step, the last included where the step reaches it,
/// separated by commas: "45", "0:350:10", "15,17,30:50:5". In the order given.
std::vector<double> parse_angles_deg(std::string_view option, std::string_view text);

/// One line that reports where a range in the text of parse_angles_deg() stops, if it does not reach its end; else empty.
std::string unmet_end(std::string_view option, std::string_view text);

/// "128x128" or "128,128": azimuth × range; one number is a square.
std::pair<int, int> parse_image_size(std::string_view option, std::string_view text);

/// "0.3" or "0.3,0.2": azimuth, range (m).
std::pair<double, double> parse_spacing_m(std::string_view option, std::string_view text);

/// The parts of a list that is separated by commas; none of an empty text.
std::vector<std::string> parts_of(const std::string& list);

/// "x,y,z".
glm::dvec3 parse_vector(std::string_view option, std::string_view text);

/// Metres per unit: m, cm, mm, km, ft, in, or a number.
double parse_units_m(std::string_view option, std::string_view text);

/// Bytes: "8G", "500M", "1.5GiB", "2000000". K, M, G, T are powers of 1024.
std::uint64_t parse_bytes(std::string_view option, std::string_view text);

/// A time above zero: "90", "90s", "2m", "1.5h".
double parse_seconds(std::string_view option, std::string_view text);

/// "1.5 GiB".
std::string bytes_text(std::uint64_t bytes);

/// Limits of altitude and slant range. No SAR is closer than a laboratory's table or farther than the moon's orbit.
inline constexpr double kNearestRadar_m = 1e-3, kFarthestRadar_m = 1e9;

/// Incidences (deg) from --pitch or --depression, as parse_angles_deg() reads them; empty if both texts are empty.
/// Throws UsageError for angles outside 0 to 90 degrees (both excluded), and if the two contradict each other.
std::vector<double> incidences_deg(const std::string& pitch, const std::string& depression);

/// The kind of value that an option takes. CommandLine::add() binds it to a variable.
template <class T>
struct Kind {
  std::string type;  ///< its name in help: "M", "N|auto"
  /// Converts a text to a value; throws UsageError with the option's name.
  std::function<T(const std::string& option, const std::string& text)> read;
  std::function<std::string(const T&)> show;  ///< the text of a default in help; help omits an empty one
  std::vector<std::string> names = {};        ///< unless empty, the parser itself refuses all other texts

  /// The same kind with a check before it reads: `refuse` throws UsageError for some of the texts.
  Kind checked(std::function<void(const std::string& option, const std::string& text)> refuse) const {
    Kind kind = *this;
    kind.read = [=, read = read](const auto& option, const auto& text) {
      refuse(option, text);
      return read(option, text);
    };
    return kind;
  }

  /// The same kind plus one word for a value that no other text has: "N|auto", 0.
  Kind or_word(const std::string& word, const T& meaning) const {
    return {type + "|" + word,
            [=, read = read](const auto& option, const auto& text) { return text == word ? meaning : read(option, text); },
            [=, show = show](const T& value) { return value == meaning ? word : show(value); }};
  }

  /// The same kind plus one word for an empty value.
  Kind<std::optional<T>> or_word(const std::string& word) const {
    return {type + "|" + word,
            [=, read = read](const auto& option, const auto& text) {
              return text == word ? std::nullopt : std::optional<T>(read(option, text));
            },
            [=, show = show](const std::optional<T>& value) { return value ? show(*value) : word; }};
  }
};

// Kinds that use the functions above. `type` is the name in help.
Kind<std::string> text(std::string type);
Kind<std::filesystem::path> path(std::string type);
Kind<double> number(std::string type);
Kind<double> positive(std::string type);
Kind<double> between(std::string type, double least, double most);
Kind<double> part(std::string type, double least, double most);
Kind<std::int64_t> whole(std::string type, std::int64_t least, std::int64_t most);
Kind<std::vector<double>> angles_deg();
Kind<std::pair<int, int>> image_size();
Kind<std::pair<double, double>> spacing_m();
/// The physical value of one code of an image file: a number, or the quotient of two, "4/65535".
Kind<double> code_value();
Kind<glm::dvec3> point_m();
Kind<double> units_m();
Kind<double> seconds();

/// One of several words, each of which stands for a value. Without a `type`, help lists all words.
template <class T>
Kind<T> one_of(const std::vector<std::pair<std::string, T>>& words, std::string type = {}) {
  const bool all = type.empty();
  std::vector<std::string> names;
  for (const auto& [word, value] : words) {
    if (all) type += (names.empty() ? "" : "|") + word;
    names.push_back(word);
  }
  using Word = std::pair<std::string, T>;
  return {type, [=](const auto&, const auto& text) { return std::ranges::find(words, text, &Word::first)->second; },
          [=](const T& value) { return std::ranges::find(words, value, &Word::second)->first; }, names};
}

/// The result of a function of the text; `shown` is the default in help.
template <class Make>
auto made_by(std::string type, Make make, std::string shown = {}) {
  using T = std::decay_t<std::invoke_result_t<Make, const std::string&>>;
  return Kind<T>{std::move(type), [make](const std::string&, const std::string& text) { return make(text); },
                 [shown](const T&) { return shown; }};
}

/// One `name = value` of a file.
struct FlatItem {
  std::string name;
  std::vector<std::string> values;  ///< one, or those of an array; quotes removed
  int line = 0;                     ///< from 1
};

/// Reads a TOML file without sections; `file` goes into messages. Throws InputError with file and line for invalid
/// TOML, sections, dates, and empty or nested lists, and with the file alone for one with thousands of dots.
std::vector<FlatItem> read_flat_toml(std::istream& input, const std::string& file);

}  // namespace sarnerf::app

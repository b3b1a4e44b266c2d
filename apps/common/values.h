// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <istream>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <glm/glm.hpp>

namespace sarnerf::app {

// Texts of the command line to values. Each throws UsageError with the option's name, what was
// expected, with an example, and what was found.

/// A finite number.
double parse_number(std::string_view option, std::string_view text);

/// A finite number above zero.
double parse_positive(std::string_view option, std::string_view text);

/// A number between two limits, both allowed.
double parse_between(std::string_view option, std::string_view text, double least, double most);

/// A part of one: "0.01" or "1%", between two limits, both allowed.
double parse_part(std::string_view option, std::string_view text, double least, double most);

/// A whole number from `least` to `most`.
std::int64_t parse_whole(std::string_view option, std::string_view text, std::int64_t least,
                         std::int64_t most);

/// Angles (deg): numbers and ranges first:last:step, the last included where the step reaches it,
/// separated by commas: "45", "0:350:10", "15,17,30:50:5". In the order given.
std::vector<double> parse_angles_deg(std::string_view option, std::string_view text);

/// One line when a range in the text of parse_angles_deg() does not arrive at its end, saying where it
/// stops; else empty.
std::string unmet_end(std::string_view option, std::string_view text);

/// "128x128" or "128,128": azimuth × range; one number is a square.
std::pair<int, int> parse_image_size(std::string_view option, std::string_view text);

/// "0.3" or "0.3,0.2": azimuth, range (m).
std::pair<double, double> parse_spacing_m(std::string_view option, std::string_view text);

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

/// Limits of altitude and slant range: beyond the moon's orbit, or on a laboratory's table, nothing is a SAR.
inline constexpr double kNearestRadar_m = 1e-3, kFarthestRadar_m = 1e9;

/// Incidences (deg) of --pitch or --depression, as parse_angles_deg() reads them; none where both are empty. Throws
/// UsageError for angles that no view can have and where the two contradict each other.
std::vector<double> incidences_deg(const std::string& pitch, const std::string& depression);

/// One `name = value` of a file.
struct FlatItem {
  std::string name;
  std::vector<std::string> values;  ///< one, or those of an array; quotes removed
  int line = 0;                     ///< from 1
};

/// Reads a TOML file without sections; `file` goes into messages. Throws InputError with file and line for
/// whatever TOML does not allow, for sections, dates and lists of lists, and for names of thousands of parts.
std::vector<FlatItem> read_flat_toml(std::istream& input, const std::string& file);

}  // namespace sarnerf::app

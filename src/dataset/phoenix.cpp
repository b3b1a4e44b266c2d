// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/dataset/phoenix.h"

#include <algorithm>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "sarnerf/core/error.h"
#include "sarnerf/core/files.h"
#include "sarnerf/core/text.h"
#include "sarnerf/core/units.h"
#include "sarnerf/dataset/posed_image.h"

namespace sarnerf {

namespace {

/// The "Name= value" lines of a Phoenix header. Every error is an InputError that names file and field.
class PhoenixHeader {
 public:
  /// Parses the beginning of a file up to "[EndofPhoenixHeader]".
  PhoenixHeader(std::string_view file, std::string where);

  /// Bytes up to and including the header's last line.
  std::size_t size() const { return size_; }

  std::string text(std::string_view name) const;  ///< empty when missing
  std::optional<double> number(std::string_view name) const;
  double positive_number(std::string_view name) const;
  std::size_t whole_number(std::string_view name, std::size_t least, std::size_t most) const;

  [[noreturn]] void fail(const std::string& what) const;

 private:
  std::string where_;
  std::size_t size_ = 0;
  std::map<std::string, std::string, std::less<>> fields_;
};

constexpr std::string_view kBegin = "[PhoenixHeaderVer";
constexpr std::string_view kEnd = "[EndofPhoenixHeader]";

/// Longest header. Real ones have two thousand bytes; a megabyte without an end is not a header.
constexpr std::size_t kMostBytes = 1 << 20;

std::string_view trimmed(std::string_view text) {
  const auto begin = text.find_first_not_of(" \t\r");
  if (begin == std::string_view::npos) return {};
  return text.substr(begin, text.find_last_not_of(" \t\r") - begin + 1);
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

constexpr std::size_t kMostSide = 65535;

/// Measured depressions lie within a degree of the desired ones. If they differ by more than this, one of the two is
/// wrong, and it is unknown which.
constexpr double kMostDepressionError_deg = 3.0;

/// Amplitudes of any calibration lie far inside these limits; floats read in the wrong byte order do not.
constexpr float kMostMagnitude = 1e15f, kLeastPeak = 1e-20f;
constexpr float kMostPhase_rad = static_cast<float>(2.0 * kPi) + 1e-3f;

enum class ByteOrder { big, little };

float float_at(const std::byte* at, ByteOrder order) {
  std::uint32_t bits = 0;
  for (int n = 0; n < 4; ++n)
    bits = bits << 8 | std::to_integer<std::uint32_t>(at[order == ByteOrder::big ? n : 3 - n]);
  return std::bit_cast<float>(bits);
}

Image<float> floats(std::span<const std::byte> bytes, int n_rows, int n_columns, ByteOrder order) {
  Image<float> image(n_rows, n_columns);
  const std::byte* at = bytes.data();
  for (float& value : image.pixels()) {
    value = float_at(at, order);
    at += sizeof(float);
  }
  return image;
}

bool are_magnitudes(const Image<float>& image) {
  float most = 0.0f;
  for (const float value : image.pixels()) {
    if (!(value >= 0.0f && value <= kMostMagnitude)) return false;
    most = std::max(most, value);
  }
  return most == 0.0f || most >= kLeastPeak;
}

bool are_phases(const Image<float>& image) {
  return std::all_of(image.pixels().begin(), image.pixels().end(),
                     [](float value) { return std::abs(value) <= kMostPhase_rad; });
}

void read_pixels(std::span<const std::byte> data, int n_rows, int n_columns,
                 const PhoenixHeader& header, PhoenixChip& chip) {
  const auto magnitudes = data.first(data.size() / 2), phases = data.last(data.size() / 2);
  chip.magnitude = floats(magnitudes, n_rows, n_columns, ByteOrder::big);
  chip.phase_rad = floats(phases, n_rows, n_columns, ByteOrder::big);
  if (are_magnitudes(chip.magnitude) && are_phases(chip.phase_rad)) return;
  const bool swapped = are_magnitudes(floats(magnitudes, n_rows, n_columns, ByteOrder::little)) &&
                       are_phases(floats(phases, n_rows, n_columns, ByteOrder::little));
  header.fail(swapped ? "the pixels are magnitudes and phases in little-endian byte order only; "
                        "Phoenix files are "
                        "big-endian: swap the bytes of the data back"
                      : "the pixels are no magnitudes and phases: negative, not finite or beyond "
                        "all measure; the data "
                        "is damaged, or PhoenixHeaderLength wrong");
}

void check_depressions(const PhoenixChip& chip, const PhoenixHeader& header) {
  for (const auto& angle_deg : {chip.desired_depression_deg, chip.measured_depression_deg})
    if (angle_deg && !is_depression(*angle_deg))
      header.fail("expected depressions between 0 and 90 degrees, both excluded, found " +
                  std::to_string(*angle_deg));
  if (!chip.desired_depression_deg && !chip.measured_depression_deg)
    header.fail("the header has no depression: neither MeasuredDepression nor DesiredDepression");
  if (chip.desired_depression_deg && chip.measured_depression_deg &&
      std::abs(*chip.desired_depression_deg - *chip.measured_depression_deg) >
          kMostDepressionError_deg) {
    char text[160];
    std::snprintf(text, sizeof text,
                  "DesiredDepression %.6g and MeasuredDepression %.6g contradict each other: they "
                  "are more than %g "
                  "degrees apart; correct or remove the wrong one",
                  *chip.desired_depression_deg, *chip.measured_depression_deg,
                  kMostDepressionError_deg);
    header.fail(text);
  }
}

std::optional<double> range_m(const PhoenixHeader& header, std::string_view name) {
  const auto value = header.number(name);
  if (value && !(*value > 0.0))
    header.fail(std::string(name) + ": expected metres above 0, found " + header.text(name));
  return value;
}

/// Resolution for weightings such as "-35dB_Taylor", with the usual four nearly equal sidelobes; empty for others.
std::optional<Resolution> resolution_in(const PhoenixHeader& header) {
  const auto azimuth_m = header.number("CrossRangeResolution"), range_m = header.number("RangeResolution");
  const std::string weighting = header.text("RangeWeighting");
  const std::size_t unit = weighting.find("dB_Taylor");
  if (!azimuth_m || !range_m || !(*azimuth_m > 0.0) || !(*range_m > 0.0) || unit == std::string::npos ||
      header.text("CrossRangeWeighting") != weighting)
    return {};
  try {
    return Resolution{*azimuth_m, *range_m, window_from_text("taylor:" + weighting.substr(0, unit))};
  } catch (const UsageError&) {
    return {};
  }
}

}  // namespace

bool begins_as_phoenix(std::string_view text) {
  const std::size_t begin = std::min(text.find_first_not_of("\r\n"), text.size());
  return begin <= kPhoenixHeadBytes - kBegin.size() && text.substr(begin).starts_with(kBegin);
}

PhoenixChip parse_phoenix(std::span<const std::byte> bytes, const std::string& where) {
  const PhoenixHeader header({reinterpret_cast<const char*>(bytes.data()), bytes.size()}, where);
  PhoenixChip chip;
  const auto n_rows = header.whole_number("NumberOfRows", 1, kMostSide);
  const auto n_columns = header.whole_number("NumberOfColumns", 1, kMostSide);
  const auto azimuth_deg = header.number("TargetAz");
  if (!azimuth_deg)
    header.fail("the header has no TargetAz, without which the radar's azimuth is unknown");
  chip.target_azimuth_deg = *azimuth_deg;
  chip.desired_depression_deg = header.number("DesiredDepression");
  chip.measured_depression_deg = header.number("MeasuredDepression");
  check_depressions(chip, header);
  chip.desired_range_m = range_m(header, "DesiredRange");
  chip.measured_range_m = range_m(header, "MeasuredRange");
  chip.range_spacing_m = header.positive_number("RangePixelSpacing");
  chip.cross_range_spacing_m = header.positive_number("CrossRangePixelSpacing");
  chip.resolution = resolution_in(header);
  chip.target_type = header.text("TargetType");
  chip.target_serial = header.text("TargetSerNum");
  chip.file_name = header.text("Filename");
  if (const std::string place = header.text("RadarPosition"); !place.empty() && place != "bottom")
    header.fail("expected RadarPosition bottom, rows from far to near range; found '" + place +
                "'");

  const std::size_t head = header.whole_number("PhoenixHeaderLength", header.size(), bytes.size());
  const std::size_t native = header.number("native_header_length")
                                 ? header.whole_number("native_header_length", 0, bytes.size())
                                 : 0;
  const std::size_t begin = head + native,
                    expected = begin + 2 * sizeof(float) * n_rows * n_columns;
  if (bytes.size() < expected)
    header.fail("the chip is truncated: " + std::to_string(n_rows) + " x " +
                std::to_string(n_columns) + " magnitudes and phases end at byte " +
                std::to_string(expected) + ", the file at byte " + std::to_string(bytes.size()));
  read_pixels(bytes.subspan(begin, expected - begin), static_cast<int>(n_rows),
              static_cast<int>(n_columns), header, chip);
  return chip;
}

PhoenixChip read_phoenix(const std::filesystem::path& path) {
  const std::string file = read_whole_file(path);
  return parse_phoenix(std::as_bytes(std::span(file)), path.string());
}

namespace {

void append(std::string& header, const char* name, const std::string& value) {
  header += std::string(name) + "= " + in_one_line(value) + "\n";
}

/// The shortest text that reads back as the same double.
void append(std::string& header, const char* name, double value) {
  char text[40];
  for (const int digits : {6, 10, 15, 17}) {
    std::snprintf(text, sizeof text, "%.*g", digits, value);
    if (std::stod(text) == value) break;
  }
  append(header, name, text);
}

void append(std::string& header, const char* name, const std::optional<double>& value) {
  if (value) append(header, name, *value);
}

/// Ten digits, so that the header's length does not depend on the number.
std::string fixed_width(std::size_t number) {
  char text[32];
  std::snprintf(text, sizeof text, "%010zu", number);
  return text;
}

std::string header_text(const PhoenixChip& chip, std::size_t header_bytes) {
  const Image<float>& image = chip.magnitude;
  std::string h = "\n[PhoenixHeaderVer01.04]\n";
  append(h, "PhoenixHeaderLength", fixed_width(header_bytes));
  append(h, "PhoenixSigSize",
         fixed_width(header_bytes + 2 * sizeof(float) * image.pixels().size()));
  append(h, "PhoenixSigNum", std::string("0001"));
  append(h, "native_header_length", 0.0);
  append(h, "Filename", chip.file_name);
  append(h, "NumberOfColumns", static_cast<double>(image.n_range()));
  append(h, "NumberOfRows", static_cast<double>(image.n_azimuth()));
  append(h, "TargetType", chip.target_type);
  append(h, "TargetSerNum", chip.target_serial);
  append(h, "TargetAz", chip.target_azimuth_deg);
  append(h, "DesiredDepression", chip.desired_depression_deg);
  append(h, "DesiredRange", chip.desired_range_m);
  append(h, "MeasuredDepression", chip.measured_depression_deg);
  append(h, "MeasuredRange", chip.measured_range_m);
  append(h, "RadarPosition", std::string("bottom"));
  append(h, "RangePixelSpacing", chip.range_spacing_m);
  append(h, "CrossRangePixelSpacing", chip.cross_range_spacing_m);
  if (const auto& r = chip.resolution; r && r->window.kind == Window::Kind::taylor && r->window.nbar == Window{}.nbar) {
    append(h, "RangeResolution", r->range_m);
    append(h, "CrossRangeResolution", r->azimuth_m);
    append(h, "RangeWeighting", format("%.17gdB_Taylor", r->window.sidelobe_db));
    append(h, "CrossRangeWeighting", format("%.17gdB_Taylor", r->window.sidelobe_db));
  }
  return h + "[EndofPhoenixHeader]\n";
}

void append_big_endian(std::vector<std::byte>& bytes, const Image<float>& image) {
  for (const float value : image.pixels()) {
    const auto bits = std::bit_cast<std::uint32_t>(value);
    for (int shift = 24; shift >= 0; shift -= 8)
      bytes.push_back(static_cast<std::byte>(bits >> shift));
  }
}

void require_writable(const PhoenixChip& chip) {
  const Image<float>&m = chip.magnitude, &p = chip.phase_rad;
  if (m.pixels().empty() || m.n_azimuth() != p.n_azimuth() || m.n_range() != p.n_range())
    throw UsageError("a Phoenix chip needs magnitudes and as many phases");
  if (!chip.desired_depression_deg && !chip.measured_depression_deg)
    throw UsageError("a Phoenix chip needs a depression, measured or desired");
  for (const float value : m.pixels())
    if (!std::isfinite(value) || value < 0.0f)
      throw UsageError("a Phoenix chip holds magnitudes, which are finite and not below 0");
}

}  // namespace

std::vector<std::byte> encode_phoenix(const PhoenixChip& chip) {
  require_writable(chip);
  const std::string header = header_text(chip, header_text(chip, 0).size());
  std::vector<std::byte> bytes;
  bytes.reserve(header.size() + 2 * sizeof(float) * chip.magnitude.pixels().size());
  for (const char c : header) bytes.push_back(static_cast<std::byte>(c));
  append_big_endian(bytes, chip.magnitude);
  append_big_endian(bytes, chip.phase_rad);
  return bytes;
}

namespace {

/// Axes of a Phoenix chip's rows and columns for a right-looking radar. Turning an image by these is its own inverse.
constexpr std::array kChipAxes{Axis::minus_j, Axis::minus_i};

}  // namespace

double within_circle_deg(double azimuth_deg) {
  double turned = std::fmod(azimuth_deg, 360.0);
  if (turned < 0.0) turned += 360.0;
  return turned < 360.0 ? turned : 0.0;  // 360 minus a tiny number rounds to 360
}

Chip chip_of(const PhoenixChip& phoenix, double assumed_range_m) {
  Chip chip;
  chip.image = to_radar_axes(phoenix.magnitude, kChipAxes);
  const double depression_deg =
      phoenix.measured_depression_deg.value_or(phoenix.desired_depression_deg.value_or(0.0));
  chip.depression_is_nominal = !phoenix.measured_depression_deg;
  const double rounded_deg = std::round(depression_deg);
  chip.nominal_depression_deg =
      phoenix.desired_depression_deg.value_or(rounded_deg > 0.0 ? rounded_deg : depression_deg);
  chip.resolution = phoenix.resolution;
  chip.range_is_assumed = !phoenix.measured_range_m && !phoenix.desired_range_m;

  DatasetView& view = chip.view;
  view.azimuth_deg = within_circle_deg(phoenix.target_azimuth_deg);
  view.incidence_deg = 90.0 - depression_deg;
  view.slant_range_m =
      phoenix.measured_range_m.value_or(phoenix.desired_range_m.value_or(assumed_range_m));
  view.n_azimuth = chip.image.n_azimuth();
  view.n_range = chip.image.n_range();
  view.azimuth_spacing_m = phoenix.cross_range_spacing_m;
  view.range_spacing_m = phoenix.range_spacing_m;
  view.class_name = phoenix.target_type;
  view.serial = phoenix.target_serial;
  view.source = phoenix.file_name;
  return chip;
}

PhoenixChip phoenix_of(const DatasetView& view, const Image<float>& amplitude) {
  if (amplitude.n_azimuth() != view.n_azimuth || amplitude.n_range() != view.n_range)
    throw UsageError("a view and its image differ in size");
  PhoenixChip phoenix;
  phoenix.target_azimuth_deg = view.azimuth_deg;
  phoenix.desired_depression_deg = phoenix.measured_depression_deg = view.depression_deg();
  phoenix.desired_range_m = phoenix.measured_range_m = view.slant_range_m;
  phoenix.range_spacing_m = view.range_spacing_m;
  phoenix.cross_range_spacing_m = view.azimuth_spacing_m;
  phoenix.target_type = view.class_name;
  phoenix.target_serial = view.serial;
  phoenix.file_name = view.source;
  phoenix.magnitude = to_radar_axes(
      amplitude, view.look == Look::right ? kChipAxes : std::array{Axis::plus_j, Axis::minus_i});
  phoenix.phase_rad = Image<float>(phoenix.magnitude.n_azimuth(), phoenix.magnitude.n_range());
  return phoenix;
}

Chip cropped(Chip chip, int n_azimuth, int n_range, const std::string& where) {
  const Image<float>& whole = chip.image;
  if (whole.n_azimuth() < n_azimuth || whole.n_range() < n_range)
    throw InputError(
        where + ": " + std::to_string(whole.n_azimuth()) + " x " + std::to_string(whole.n_range()) +
        " pixels (azimuth x range) cannot be cropped to " + std::to_string(n_azimuth) + " x " +
        std::to_string(n_range) + "; choose a smaller crop or leave this image out");
  chip.image = middle_of(whole, n_azimuth, n_range);
  chip.view.n_azimuth = n_azimuth;
  chip.view.n_range = n_range;
  return chip;
}

}  // namespace sarnerf

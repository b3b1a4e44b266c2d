// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/dataset/phoenix.h"

#include <algorithm>
#include <limits>

#include "catch.h"
#include "phoenix_chips.h"
#include "sarnerf/core/error.h"
#include "sarnerf/core/text.h"

using namespace sarnerf;
using namespace sarnerf::test;

namespace {

std::string text_of(const std::vector<std::byte>& bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

PhoenixChip parse(const std::string& text) {
  return parse_phoenix(std::as_bytes(std::span(text)), "chip");
}

std::string refusal(const std::string& text) {
  try {
    parse(text);
  } catch (const InputError& e) {
    return e.what();
  }
  return "accepted";
}

std::string numbered_text() { return text_of(encode_phoenix(numbered_chip())); }

/// The text with a header line replaced by one of the same length, or removed and padded, so that the data stays put.
std::string with_line(std::string text, const std::string& name, std::string line) {
  const auto at = text.find("\n" + name + "=") + 1, end = text.find('\n', at);
  REQUIRE(at != 0);
  REQUIRE(line.size() <= end - at);
  line.resize(end - at, ' ');
  return text.replace(at, end - at, line);
}

bool same(const Image<float>& a, const Image<float>& b) {
  return a.n_azimuth() == b.n_azimuth() && a.n_range() == b.n_range() &&
         std::equal(a.pixels().begin(), a.pixels().end(), b.pixels().begin());
}

}  // namespace

TEST_CASE("a Phoenix chip comes back as it was written") {
  const PhoenixChip written = numbered_chip(), read = parse(numbered_text());
  CHECK(same(read.magnitude, written.magnitude));
  CHECK(same(read.phase_rad, written.phase_rad));
  CHECK(read.target_azimuth_deg == written.target_azimuth_deg);
  CHECK(read.desired_depression_deg == written.desired_depression_deg);
  CHECK(read.measured_depression_deg == written.measured_depression_deg);
  CHECK(read.desired_range_m == written.desired_range_m);
  CHECK(read.measured_range_m == written.measured_range_m);
  CHECK(read.range_spacing_m == written.range_spacing_m);
  CHECK(read.cross_range_spacing_m == written.cross_range_spacing_m);
  CHECK(read.target_type == written.target_type);
  CHECK(read.target_serial == written.target_serial);
  CHECK(read.file_name == written.file_name);
  CHECK_FALSE(read.resolution);
}

TEST_CASE("a Phoenix chip's resolution comes back where its header has widths and one weighting") {
  PhoenixChip chip = numbered_chip();
  chip.resolution = Resolution{0.3047, 0.35, window_from_text("taylor:-35")};
  const std::string text = text_of(encode_phoenix(chip));
  CHECK(parse(text).resolution == chip.resolution);
  CHECK(chip_of(parse(text), 1.0).resolution == chip.resolution);
  CHECK(parse(with_line(text, "RangeWeighting", "RangeWeighting= -30dB_Taylor")).resolution == std::nullopt);
  CHECK(parse(with_line(text, "RangeWeighting", "RangeWeighting= boxcar")).resolution == std::nullopt);
  CHECK(parse(with_line(text, "RangeResolution", "RangeResolution= 0")).resolution == std::nullopt);
  // Others than Taylor's have no name there.
  chip.resolution->window = window_from_text("hann");
  CHECK_FALSE(parse(text_of(encode_phoenix(chip))).resolution);
}

TEST_CASE("the layout of a Phoenix file, byte by byte") {
  // Written by hand: one row, two columns; 1.0 and 0.5, phases 0 and 0.25; four bytes of a native header between.
  const std::string header =
      "[PhoenixHeaderVer01.04]\nPhoenixHeaderLength= 00230\nnative_header_length= "
      "4\nNumberOfColumns= 2\r\n"
      "NumberOfRows= 1\nTargetAz= 10.5\nMeasuredDepression= 15.04\nRangePixelSpacing= 0.202\n"
      "CrossRangePixelSpacing= 0.203\n[EndofPhoenixHeader]\n";
  REQUIRE(header.size() <= 230);
  const std::string data("\x3f\x80\x00\x00\x3f\x00\x00\x00\x00\x00\x00\x00\x3e\x80\x00\x00", 16);
  const PhoenixChip chip = parse(header + std::string(234 - header.size(), 'n') + data);
  CHECK(chip.magnitude.n_azimuth() == 1);
  CHECK(chip.magnitude(0, 0) == 1.0f);
  CHECK(chip.magnitude(0, 1) == 0.5f);
  CHECK(chip.phase_rad(0, 1) == 0.25f);
  CHECK_FALSE(chip.desired_depression_deg);
  CHECK_FALSE(chip.measured_range_m);
  CHECK(chip.target_type.empty());
}

TEST_CASE("damaged Phoenix chips are refused, each by its own fault") {
  const std::string whole = numbered_text();
  const auto says = [](const std::string& text, const char* piece) {
    const std::string message = refusal(text);
    INFO(message);
    CHECK(message.starts_with("chip: "));
    CHECK_FALSE(has_control_characters(message));
    CHECK(message.find(piece) != std::string::npos);
  };
  says("", "begins with [PhoenixHeaderVer");
  says("II*\0 a TIFF", "begins with [PhoenixHeaderVer");
  says(std::string(100, '\n') + whole, "begins with [PhoenixHeaderVer");
  says(whole.substr(0, 200), "the header has no end");
  says(whole.substr(0, whole.size() - 1), "the chip is truncated");
  says(whole.substr(0, whole.size() / 2), "the chip is truncated");
  says(with_line(whole, "TargetAz", ""), "no TargetAz");
  says(with_line(whole, "TargetAz", "TargetAz= north"),
       "TargetAz: expected a number, found 'north'");
  says(with_line(whole, "TargetAz", "TargetAz= nan"), "TargetAz: expected a number");
  says(with_line(with_line(whole, "MeasuredDepression", ""), "DesiredDepression", ""),
       "no depression");
  says(with_line(whole, "DesiredDepression", "DesiredDepression= 30"), "contradict each other");
  says(with_line(whole, "MeasuredDepression", "MeasuredDepression= 95"), "between 0 and 90");
  says(with_line(whole, "MeasuredDepression", "MeasuredDepression=1e-84"), "between 0 and 90");
  says(with_line(whole, "NumberOfRows", "NumberOfRows= 0"),
       "NumberOfRows: expected a whole number from 1");
  says(with_line(whole, "NumberOfRows", ""), "no NumberOfRows");
  says(with_line(whole, "RangePixelSpacing", ""), "no RangePixelSpacing");
  says(with_line(whole, "CrossRangePixelSpacing", "CrossRangePixelSpacing= 0"),
       "expected a number above 0");
  says(with_line(whole, "MeasuredRange", "MeasuredRange= 0"), "expected metres above 0");
  says(with_line(whole, "RadarPosition", "RadarPosition= top"), "expected RadarPosition bottom");
  says(with_line(whole, "PhoenixHeaderLength", "PhoenixHeaderLength= 10"),
       "PhoenixHeaderLength: expected");
}

TEST_CASE("the wrong byte order shows in values that no chip has") {
  std::string text = numbered_text();
  const std::size_t begin = text.size() - 2 * 4 * 48 * 40;
  for (std::size_t at = begin; at < text.size(); at += 4)
    std::reverse(text.data() + at, text.data() + at + 4);
  CHECK(refusal(text).find("little-endian") != std::string::npos);

  // Round numbers become tiny ones, which are no magnitudes either.
  PhoenixChip round = numbered_chip();
  std::fill(round.magnitude.pixels().begin(), round.magnitude.pixels().end(), 0.5f);
  text = text_of(encode_phoenix(round));
  for (std::size_t at = begin; at < text.size(); at += 4)
    std::reverse(text.data() + at, text.data() + at + 4);
  CHECK(refusal(text).find("little-endian") != std::string::npos);

  text = numbered_text();
  text.replace(begin, 4, "\x7f\xc0\x00\x00", 4);  // not a number
  CHECK(refusal(text).find("no magnitudes") != std::string::npos);
  text.replace(begin, 4, "\xbf\x80\x00\x00", 4);  // −1
  CHECK(refusal(text).find("no magnitudes") != std::string::npos);
}

TEST_CASE("what is no chip is not written") {
  PhoenixChip chip = numbered_chip();
  chip.magnitude(3, 4) = -1.0f;
  CHECK_THROWS_AS(encode_phoenix(chip), UsageError);
  chip.magnitude(3, 4) = std::numeric_limits<float>::infinity();
  CHECK_THROWS_AS(encode_phoenix(chip), UsageError);
  chip = numbered_chip();
  chip.phase_rad = Image<float>(2, 2);
  CHECK_THROWS_AS(encode_phoenix(chip), UsageError);
  chip = numbered_chip();
  chip.desired_depression_deg = chip.measured_depression_deg = std::nullopt;
  CHECK_THROWS_AS(encode_phoenix(chip), UsageError);

  // A name with a line break cannot smuggle a field in.
  chip = numbered_chip();
  chip.file_name = "a\nTargetAz= 1";
  CHECK(parse(text_of(encode_phoenix(chip))).target_azimuth_deg == 346.491974);
}

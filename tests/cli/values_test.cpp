// SPDX-License-Identifier: Apache-2.0
#include "values.h"

#include "catch.h"
#include "command_line.h"
#include "sarnerf/core/error.h"

using namespace sarnerf;
using namespace sarnerf::app;

TEST_CASE("angles: numbers, lists, ranges with their end") {
  const auto angles = [](const char* text) { return parse_angles_deg("--azimuth", text); };
  CHECK(angles("45") == std::vector{45.0});
  CHECK(angles("-7.5,+3") == std::vector{-7.5, 3.0});
  CHECK(angles("0:350:10").size() == 36);
  CHECK(angles("0:359:1").back() == 359.0);
  CHECK(angles("35:40:2") == std::vector{35.0, 37.0, 39.0});
  CHECK(angles("3:1:-1") == std::vector{3.0, 2.0, 1.0});
  CHECK(angles("1,10:20:5,90") == std::vector{1.0, 10.0, 15.0, 20.0, 90.0});
  CHECK(angles("5:5:1") == std::vector{5.0});
  // Decimal steps give decimal numbers, and rounding does not lose the end.
  const auto tenths = angles("0:0.7:0.1");
  CHECK(tenths == std::vector{0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7});
  for (const char* bad : {"", "x", "1:2", "1:2:3:4", "0:10:0", "0:10:-1", "1,,2", "1;2", "nan", "inf",
                          "0:1e9:1e-3", "1 2"}) {
    INFO(bad);
    CHECK_THROWS_AS(angles(bad), UsageError);
  }
}

TEST_CASE("sizes, spacings, vectors, units") {
  CHECK(parse_image_size("--size", "128x64") == std::pair(128, 64));
  CHECK(parse_image_size("--size", "128X64") == std::pair(128, 64));
  CHECK(parse_image_size("--size", "128") == std::pair(128, 128));
  for (const char* bad : {"0x1", "1x0", "-1x2", "1.5x2", "1x2x3", "x", "1x", "65536", "70000x1"}) {
    CHECK_THROWS_AS(parse_image_size("--size", bad), UsageError);
  }
  CHECK(parse_spacing_m("--spacing", "0.3") == std::pair(0.3, 0.3));
  CHECK(parse_spacing_m("--spacing", "0.3,0.2") == std::pair(0.3, 0.2));
  for (const char* bad : {"0", "-1", "1,0", "1,2,3", "inf"}) {
    CHECK_THROWS_AS(parse_spacing_m("--spacing", bad), UsageError);
  }
  CHECK(parse_vector("--aim", "1,-2.5,3e2") == glm::dvec3(1, -2.5, 300));
  CHECK_THROWS_AS(parse_vector("--aim", "1,2"), UsageError);
  CHECK_THROWS_AS(parse_vector("--aim", "1,2,3,4"), UsageError);
  CHECK_THROWS_AS(parse_vector("--aim", "1,2e9,3"), UsageError);
  CHECK(parse_units_m("--units", "ft") == 0.3048);
  CHECK(parse_units_m("--units", "2.5") == 2.5);
  CHECK_THROWS_AS(parse_units_m("--units", "miles"), UsageError);
  CHECK_THROWS_AS(parse_units_m("--units", "-1"), UsageError);
  CHECK_THROWS_AS(parse_whole("--threads", "0", 1, 4), UsageError);
  CHECK_THROWS_AS(parse_whole("--threads", "2.5", 1, 4), UsageError);
  CHECK(parse_whole("--threads", "4", 1, 4) == 4);
}

TEST_CASE("kinds: words beside values, and what help shows of them") {
  const auto steps = whole("N", 1, 9).or_word("auto", 0);
  CHECK(steps.type == "N|auto");
  CHECK(steps.read("--steps", "auto") == 0);
  CHECK(steps.read("--steps", "4") == 4);
  CHECK_THROWS_AS(steps.read("--steps", "0"), UsageError);
  CHECK(steps.show(0) == "auto");
  CHECK(steps.show(4) == "4");
  const auto spacing = spacing_m().or_word("none");
  CHECK(spacing.read("--spacing", "none") == std::nullopt);
  CHECK(spacing.show(std::nullopt) == "none");
  CHECK(spacing.show(std::pair(0.3, 0.3)) == "0.3");
  CHECK(spacing.show(std::pair(0.3, 0.25)) == "0.3,0.25");
  CHECK(angles_deg().show({0.0, 12.5}) == "0,12.5");
  const auto side = one_of<int>({{"left", -1}, {"right", 1}});
  CHECK(side.type == "left|right");
  CHECK(side.read("--look", "right") == 1);
  CHECK(side.show(-1) == "left");
}

TEST_CASE("options are read in the order in which they were added, unless told otherwise") {
  const auto outcome = [](std::vector<std::string> arguments) {
    CommandLine command("program", "", "");
    command.begin_group("Options");
    double a = 1.0, b = 2.0;
    std::optional<double> c;
    command.add("-a,--alpha", a, positive("M"), "");
    command.add("--beta", b, positive("M"), "");
    command.then([&] {
      if (command.given("--beta") && a > b) throw UsageError("alpha above beta");
    });
    command.add("--gamma", c, positive("M"), "");
    command.read_later({"--beta", "--absent"});
    std::vector<char*> pointers;
    arguments.insert(arguments.begin(), "program");
    for (std::string& argument : arguments) pointers.push_back(argument.data());
    try {
      command.parse(static_cast<int>(pointers.size()), pointers.data());
    } catch (const UsageError& e) {
      return std::string(e.what());
    }
    return std::to_string(a) + " " + std::to_string(b) + " " + (c ? std::to_string(*c) : "none");
  };
  CHECK(outcome({}) == "1.000000 2.000000 none");
  CHECK(outcome({"--beta", "4", "--gamma", "5", "-a", "1.5"}) == "1.500000 4.000000 5.000000");
  CHECK(outcome({"--beta", "x", "--gamma", "x", "--alpha", "x"}).starts_with("--alpha: "));
  CHECK(outcome({"--beta", "x", "--gamma", "x"}).starts_with("--gamma: "));
  CHECK(outcome({"--beta", "x", "--alpha", "3"}) == "alpha above beta");  // against the default, --beta being unread
  CHECK(outcome({"--beta", "x"}).starts_with("--beta: "));
  CHECK(outcome({"--beta", "x", "--delta"}).starts_with("unknown option --delta"));
}

TEST_CASE("bytes: powers of 1024, with and without B") {
  CHECK(parse_bytes("--max-memory", "1000") == 1000);
  CHECK(parse_bytes("--max-memory", "8G") == 8ull << 30);
  CHECK(parse_bytes("--max-memory", "8GB") == 8ull << 30);
  CHECK(parse_bytes("--max-memory", "1.5GiB") == 3ull << 29);
  CHECK(parse_bytes("--max-memory", "4k") == 4096);
  CHECK(parse_bytes("--max-memory", "1T") == 1ull << 40);
  for (const char* bad : {"", "G", "-1G", "0", "8X", "8GG", "1e30"}) {
    INFO(bad);
    CHECK_THROWS_AS(parse_bytes("--max-memory", bad), UsageError);
  }
  CHECK(bytes_text(500) == "500 B");
  CHECK(bytes_text(3ull << 29) == "1.5 GiB");
}

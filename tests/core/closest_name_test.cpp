// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/core/text.h"

#include <vector>

#include "catch.h"

using namespace sarnerf;

TEST_CASE("the closest name: few edits, case ignored, cut short; nothing for another word") {
  const std::vector<std::string> names = {"pitch", "depression", "azimuth", "aim", "look"};
  CHECK(closest_name("pich", names) == "pitch");
  CHECK(closest_name("PITCH", names) == "pitch");
  CHECK(closest_name("azimut", names) == "azimuth");
  CHECK(closest_name("depr", names) == "depression");
  CHECK(closest_name("lok", names) == "look");
  CHECK(closest_name("zebra", names).empty());
  CHECK(closest_name("", names).empty());
  CHECK(closest_name(std::string(1000, 'a'), names).empty());
  CHECK(closest_name("pitch", {}).empty());
}

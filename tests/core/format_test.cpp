// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/core/format.h"

#include "catch.h"

TEST_CASE("format is printf without its buffer") {
  CHECK(sarnerf::format("%d of %zu: %.2f m%s", 3, std::size_t{7}, 1.005e1, "!") == "3 of 7: 10.05 m!");
  CHECK(sarnerf::format("%s", "").empty());
  const std::string long_text(10'000, 'x');
  CHECK(sarnerf::format("<%s>", long_text.c_str()) == "<" + long_text + ">");
}

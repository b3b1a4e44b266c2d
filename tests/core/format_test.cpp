// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/core/text.h"

#include "catch.h"

TEST_CASE("format is printf without its buffer") {
  CHECK(sarnerf::format("%d of %zu: %.2f m%s", 3, std::size_t{7}, 1.005e1, "!") == "3 of 7: 10.05 m!");
  CHECK(sarnerf::format("%s", "").empty());
  const std::string long_text(10'000, 'x');
  CHECK(sarnerf::format("<%s>", long_text.c_str()) == "<" + long_text + ">");
}

TEST_CASE("counts have the number of their noun, and commas") {
  CHECK(sarnerf::counted(0, "view") == "0 views");
  CHECK(sarnerf::counted(1, "view") == "1 view");
  CHECK(sarnerf::counted(2, "view") == "2 views");
  CHECK(sarnerf::counted(1, "vertex", "vertices") == "1 vertex");
  CHECK(sarnerf::counted(1234567, "vertex", "vertices") == "1,234,567 vertices");
}

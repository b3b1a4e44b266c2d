// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/report/page.h"

#include "catch.h"
#include "sarnerf/core/error.h"

using namespace sarnerf;

TEST_CASE("a table as Markdown, legible as plain text") {
  const std::string text = markdown_table({{"scene"}, {"time (ms)", Align::right}},
                                          {{"house 5×5", "3.25"}, {"a|b\nc", "12"}});
  CHECK(text ==
        "| scene     | time (ms) |\n"
        "|-----------|----------:|\n"
        "| house 5×5 |      3.25 |\n"
        "| a\\|b c    |        12 |\n");
}

TEST_CASE("rows that do not fit the columns are refused") {
  CHECK_THROWS_AS(markdown_table({}, {}), UsageError);
  CHECK_THROWS_WITH(markdown_table({{"a"}, {"b"}}, {{"1", "2"}, {"1"}}),
                    "table: expected 2 cells in row 1, found 1");
}

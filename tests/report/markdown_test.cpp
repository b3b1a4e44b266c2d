// SPDX-License-Identifier: Apache-2.0
// A page from Markdown: every kind of block, captions, and what is refused.
#include "sarnerf/report/page.h"

#include "catch.h"
#include "sarnerf/core/error.h"

using namespace sarnerf;

namespace {

Pixels one_pixel(const std::string& file) {
  Image<std::uint8_t> image(1, static_cast<int>(file.size()));
  return image;
}

template <class Block>
const Block& block(const Page& page, std::size_t n) {
  REQUIRE(n < page.blocks.size());
  REQUIRE(std::holds_alternative<Block>(page.blocks[n]));
  return std::get<Block>(page.blocks[n]);
}

constexpr const char* kText = R"(# The **paper**

Made by `sar_bench page`,
on one machine.

## Table 1
Some *words* and a [link](https://example.org/a_b).
| solid | PSNR (dB) |
|---|--:|
| cuboid | 32.87 |
| **ours** | 48.1 \| 48.2 |

*PSNR of power.*

### Fig. 9

![truth](a.png)
![generated](bc.png)
*From 0 to 90 degrees.*
*This is no caption.*

> Quick: fewer views.
> Shorter training.
)";

}  // namespace

TEST_CASE("Markdown becomes a page") {
  const Page page = page_of_markdown(kText, one_pixel);
  CHECK(page.title == "The paper");
  CHECK(page.subtitle == "Made by sar_bench page, on one machine.");
  REQUIRE(page.blocks.size() == 7);
  CHECK(block<PageHeading>(page, 0).text == "Table 1");
  CHECK(block<PageParagraph>(page, 1).text == "Some *words* and a link.");
  const auto& table = block<PageTable>(page, 2);
  CHECK(table.columns[0].heading == "solid");
  CHECK(table.columns[1].align == Align::right);
  CHECK(table.rows == std::vector<std::vector<std::string>>{{"cuboid", "32.87"}, {"ours", "48.1 | 48.2"}});
  CHECK(table.emphasised == std::vector<std::size_t>{1});
  CHECK(table.caption == "PSNR of power.");
  CHECK(block<PageHeading>(page, 3).text == "Fig. 9");
  const auto& pictures = block<PagePictures>(page, 4);
  REQUIRE(pictures.pictures.size() == 2);
  CHECK(pictures.pictures[1].name == "generated");
  CHECK(std::get<Image<std::uint8_t>>(pictures.pictures[1].pixels).n_range() == 6);
  CHECK(pictures.caption == "From 0 to 90 degrees.");
  CHECK(block<PageParagraph>(page, 5).text == "*This is no caption.*");
  CHECK(block<PageNotice>(page, 6).text == "Quick: fewer views. Shorter training.");
  CHECK(page_html(page).find("48.1 | 48.2") != std::string::npos);
}

TEST_CASE("Markdown that is no page is refused with its line") {
  CHECK_THROWS_WITH(page_of_markdown("# a\n\n| b |\n| c |\n", one_pixel), ContainsSubstring("line 4"));
  CHECK_THROWS_WITH(page_of_markdown("| b | c |\n|---|\n", one_pixel), ContainsSubstring("line 2"));
  CHECK_THROWS_WITH(page_of_markdown("| b |\n|---|\n| c | d |\n", one_pixel), ContainsSubstring("line 3"));
  CHECK_THROWS_WITH(page_of_markdown("![no file]\n", one_pixel), ContainsSubstring("line 1"));
  CHECK(page_of_markdown("", one_pixel).blocks.empty());
}

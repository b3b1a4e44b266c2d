// SPDX-License-Identifier: Apache-2.0
// scripts/paper.sh: its quick version of one solid, and every number of the page found again in what made it.
#include <nlohmann/json.hpp>

#include <cmath>
#include <cstdlib>
#include <map>
#include <sstream>

#include "catch.h"
#include "programs.h"
#include "sarnerf/core/files.h"

namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;
using Row = std::vector<std::string>;

Row cells_of(const std::string& line) {
  Row cells;
  std::istringstream rest(line.substr(1));
  for (std::string cell; std::getline(rest, cell, '|');) {
    const std::size_t first = cell.find_first_not_of(' '), last = cell.find_last_not_of(' ');
    cells.push_back(first == std::string::npos ? "" : cell.substr(first, last - first + 1));
  }
  return cells;
}

/// Rows of the tables under each heading of a Markdown text, by the first words of the heading.
std::map<std::string, std::vector<Row>> tables_of(const std::string& markdown) {
  std::map<std::string, std::vector<Row>> tables;
  std::istringstream lines(markdown);
  std::string heading;
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with("## ")) heading = line.substr(3, line.find(':') - 3);
    if (line.starts_with("| ")) tables[heading].push_back(cells_of(line));
  }
  return tables;
}

/// A cell as printed with so many digits behind the point.
bool is_printed(const std::string& cell, double value, int n_digits) {
  return std::abs(std::stod(cell) - value) <= 0.5000001 * std::pow(10.0, -n_digits);
}

}  // namespace

TEST_CASE("the quick version of the paper's tables has the numbers of the runs that it made", "[slow]") {
  const ScratchFolder folder;
  ::setenv("SARNERF_PROGRAMS", SARNERF_PROGRAMS, 1);
  const std::vector<std::string> arguments{PAPER_SCRIPT, "--quick", "--only", "solids", "--seconds", "1", "page"};
  const Outcome first = run_program("/bin/sh", arguments, {folder.path()});
  INFO(first.err);
  REQUIRE(first.code == 0);
  CHECK(first.out == "page/paper.html\n");
  CHECK(has(first.err, "min left"));
  const fs::path page = folder / "page";
  const std::string markdown = sarnerf::read_whole_file(page / "paper.md"), html = sarnerf::read_whole_file(page / "paper.html");
  auto tables = tables_of(markdown);

  for (const char* heading : {"Fig. 7", "Fig. 8", "Table 1", "Fig. 9", "Figs. 10 and 11", "Figs. 12 and 13", "Table 3"})
    CHECK(has(markdown, std::string("\n## ") + heading));
  // Only the curve in time depends on how far a training of one second comes; all pictures that were made are on the page.
  std::size_t n_pictures = 0, n_made = 0;
  for (std::size_t at = html.find("data:image/png"); at != std::string::npos; at = html.find("data:image/png", at + 1)) ++n_pictures;
  for (const auto& file : fs::directory_iterator(page)) n_made += file.path().extension() == ".png";
  CHECK(n_pictures == n_made);
  for (const char* name : {"fig7_14x8", "fig7_10x10", "fig7_8x14", "fig8_cuboid", "turn_cuboid", "pitch_cuboid.40", "pitch_cuboid.30",
                           "pitch_cuboid.60", "body_cuboid.surface", "body_cuboid.paper"})
    CHECK(fs::exists(page / (std::string(name) + ".png")));
  CHECK_FALSE(has(html, "src=\"fig"));

  int n_methods = 0;
  for (const Row& row : tables["Table 1"]) {
    if (row.size() < 8 || (row[2] != "paper" && row[2] != "mlp" && row[2] != "grid" && row[2] != "surface")) continue;
    CAPTURE(row[1], row[2]);
    const Json report = json_of(page / ("cuboid." + row[1] + "." + row[2]) / "report.json");
    const Json& mean = report.at("evaluation").at("model").at("mean");
    CHECK(is_printed(row[3], mean.at("psnr_power_db").get<double>(), 2));
    CHECK(is_printed(row[4], mean.at("ssim_power").get<double>(), 4));
    CHECK(std::stoi(row[7]) == report.at("steps").get<int>());
    CHECK(has(html, ">" + row[3] + "<"));
    ++n_methods;
  }
  CHECK(n_methods == 7);
  int n_bodies = 0;
  for (const Row& row : tables["Figs. 12 and 13"]) {
    if (row[0] != "cuboid") continue;
    CAPTURE(row[1]);
    CHECK(is_printed(row[3], json_of(page / ("cuboid." + row[1] + ".report.json")).at("scores").at("extracted").at("iou").get<double>(), 3));
    ++n_bodies;
  }
  CHECK(n_bodies == 2);

  // Again: nothing is made anew, and the page is the same. With other settings the folder is refused.
  fs::remove(page / "paper.md");
  const Outcome again = run_program("/bin/sh", arguments, {folder.path()});
  CHECK(again.code == 0);
  CHECK_FALSE(has(again.err, "min left"));
  CHECK(sarnerf::read_whole_file(page / "paper.md") == markdown);
  const Outcome other = run_program("/bin/sh", {PAPER_SCRIPT, "--only", "solids", "page"}, {folder.path()});
  CHECK(other.code == 2);
  CHECK(has(other.err, "choose another folder"));
}

// SPDX-License-Identifier: Apache-2.0
#include "matrix.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <limits>
#include <optional>
#include <string>
#include <vector>

// Listeners of Catch2 2 have to be asked for.
#define CATCH_CONFIG_EXTERNAL_INTERFACES
#include "catch.h"

namespace sarnerf::test {
namespace {

constexpr std::size_t kRows = static_cast<std::size_t>(Case::count);

struct RowText {
  Case row;
  const char *part, *tried, *reference, *measure, *edge;
};

constexpr RowText kTexts[] = {
#include "matrix_rows.inc"
};
static_assert(std::size(kTexts) == kRows);

constexpr bool rows_are_in_order() {
  for (std::size_t n = 0; n < kRows; ++n) {
    if (static_cast<std::size_t>(kTexts[n].row) != n) return false;
  }
  return true;
}
static_assert(rows_are_in_order());

std::array<std::optional<double>, kRows>& errors() {
  static std::array<std::optional<double>, kRows> all;
  return all;
}

std::string figure(const std::optional<double>& error) {
  if (!error) return "not run";
  if (*error == 0.0) return "0";
  char text[32];
  std::snprintf(text, sizeof text, "%.1e", *error);
  return text;
}

/// "| tried | reference |", with which each line of the table begins.
std::string line_begin(const RowText& text) { return std::string("| ") + text.tried + " | " + text.reference + " | "; }
std::string line_end(const RowText& text) { return std::string(text.measure) + " | " + text.edge + " |"; }

void write_table(const char* path) {
  std::ofstream file(path);
  const char* part = "";
  for (std::size_t n = 0; n < kRows; ++n) {
    const RowText& t = kTexts[n];
    if (std::string(part) != t.part) {
      part = t.part;
      file << (n > 0 ? "\n" : "") << "## " << part
           << "\n\n| tried | reference | worst error | result |\n|---|---|---|---|\n";
    }
    file << line_begin(t) << figure(errors()[n]) << ' ' << line_end(t) << '\n';
  }
}

#if __has_include(<catch2/catch_all.hpp>)
using ListenerBase = Catch::EventListenerBase;
#else
using ListenerBase = Catch::TestEventListenerBase;
#endif

/// Writes the table once all tests have run, where SARNERF_EXTREME_TABLE says.
struct TableWriter : ListenerBase {
  using ListenerBase::ListenerBase;
  void testRunEnded(const Catch::TestRunStats& stats) override {
    if (const char* path = std::getenv("SARNERF_EXTREME_TABLE")) write_table(path);
    ListenerBase::testRunEnded(stats);
  }
};

CATCH_REGISTER_LISTENER(TableWriter)

}  // namespace

TEST_CASE("docs/results/extreme.md has a line for every row", "[core]") {
  std::ifstream file(SARNERF_EXTREME_PAGE);
  REQUIRE(file);
  std::vector<std::string> lines;
  for (std::string line; std::getline(file, line);) lines.push_back(line);
  for (const RowText& text : kTexts) {
    const std::string begin = line_begin(text), end = line_end(text);
    INFO(begin << "... " << end);
    CHECK(std::any_of(lines.begin(), lines.end(), [&](const std::string& line) {
      return line.size() > begin.size() + end.size() && line.compare(0, begin.size(), begin) == 0 &&
             line.compare(line.size() - end.size(), end.size(), end) == 0;
    }));
  }
}

void record(Case row, double error) {
  std::optional<double>& worst = errors()[static_cast<std::size_t>(row)];
  const double size = std::isfinite(error) ? std::abs(error) : std::numeric_limits<double>::infinity();
  if (!worst || size > *worst) worst = size;
}

}  // namespace sarnerf::test

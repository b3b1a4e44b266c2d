// SPDX-License-Identifier: Apache-2.0
#include <sarnerf/core/error.h>
#include <sarnerf/report/plot.h>

#include <cstdio>
#include <cstring>

/// A plot becomes a PNG.
int main() try {
  sarnerf::Plot plot;
  plot.series = {{"first", {{0.0, 1.0}, {1.0, 2.0}}}};
  const auto png = sarnerf::png_of_svg(sarnerf::svg(plot));
  std::printf("%zu bytes\n", png.size());
  return png.size() > 1000 && std::memcmp(png.data(), "\x89PNG", 4) == 0 ? 0 : 1;
} catch (const sarnerf::Error& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 1;
}

// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "catch.h"
#include "sarnerf/core/error.h"
#include "nerf_common.h"

using namespace sarnerf;
using namespace sarnerf::app;

namespace {

std::vector<DatasetView> around(int n) {
  std::vector<DatasetView> views(static_cast<std::size_t>(n));
  // Backwards, so that places and azimuths differ.
  for (int k = 0; k < n; ++k)
    views[static_cast<std::size_t>(k)].azimuth_deg = 360.0 * (n - 1 - k) / n;
  return views;
}

}  // namespace

TEST_CASE("views are held out evenly, in the order of azimuth") {
  CHECK(held_out_views(around(47), {}).empty());
  const auto auto_72 = held_out_views(around(72), {});
  CHECK(auto_72 == std::vector<std::size_t>{5, 17, 29, 41, 53, 65});
  CHECK(held_out_views(around(10), parse_holdout("1")).size() == 1);
  CHECK(held_out_views(around(10), parse_holdout("30%")) ==
        held_out_views(around(10), parse_holdout("0.3")));
  CHECK(held_out_views(around(10), parse_holdout("0.3")).size() == 3);
  CHECK(held_out_views(around(10), parse_holdout("0")).empty());
  CHECK_THROWS_AS(held_out_views(around(3), parse_holdout("3")), UsageError);
  CHECK_THROWS_AS(held_out_views(around(3), parse_holdout("0.99")), UsageError);
  for (const char* wrong : {"", "-1", "half", "1.5", "200%"})
    CHECK_THROWS_AS(parse_holdout(wrong), UsageError);
}

TEST_CASE("views are the same when angles and side are, whole turns apart or not") {
  DatasetView a, b;
  a.azimuth_deg = 359.0;
  b.azimuth_deg = -1.0;
  a.incidence_deg = b.incidence_deg = 45.0;
  CHECK(same_angles(a, b));
  CHECK(unseen_views(std::vector{a}, std::vector{b}).empty());
  b.look = Look::left;
  CHECK_FALSE(same_angles(a, b));
  b.look = a.look;
  b.azimuth_deg = -1.001;
  CHECK_FALSE(same_angles(a, b));
  CHECK(unseen_views(std::vector{a}, std::vector{b}).size() == 1);
}

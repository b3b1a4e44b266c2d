// SPDX-License-Identifier: Apache-2.0
#include "deposit.h"

#include "trapezoid.h"

namespace sarnerf {

void deposit_trapezoid(std::span<double> bins, double x0, double x1, double smear, double mass) {
  for_each_share(bins.size(), x0, x1, smear,
                 [&](std::size_t j, double share) { bins[j] += mass * share; });
}

}  // namespace sarnerf

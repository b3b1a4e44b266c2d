// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>

namespace sarnerf {

/// Mean of what `value` finds in those that have it; none where none has.
template <class T, class Value>
std::optional<double> mean_of_present(std::span<const T> all, Value&& value) {
  double sum = 0.0;
  int count = 0;
  for (const T& one : all) {
    const std::optional<double> v = value(one);
    if (!v) continue;
    sum += *v;
    ++count;
  }
  if (count == 0) return std::nullopt;
  return sum / count;
}

}  // namespace sarnerf

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "sarnerf/report/plot.h"

namespace sarnerf {

/// A place on an axis. Minor ticks have no label.
struct Tick {
  double value = 0.0;
  std::string label{};
};

/// As many labels as an axis has by rule. Steps grow by at most 2.5, so with room for eight at least three fit.
inline constexpr int kMostLabels = 8;

/// The ticks of a linear axis within [low, high]: multiples of 1, 2 or 5 times a power of ten, by the
/// smallest such step that gives at most `most_labels`. With kMostLabels there are at least three. Needs
/// high − low ≥ 1e-6 max(|low|, |high|), so that every label differs from the next. In rising order.
std::vector<Tick> linear_ticks(double low, double high, int most_labels = kMostLabels);

/// The ticks of a logarithmic axis within [low, high], low > 0. Labelled are
///
///   - powers of ten, when at least three lie within; every second, third, fifth … where they are too many;
///   - else 1, 2 and 5 times powers of ten, when at least three of these do;
///   - else the ticks of a linear axis.
///
/// Powers of ten without a label, or else 2 and 5 times the labelled ones, or else 3, 4, 6, 7, 8 and 9 times, are
/// minor ticks. Same bounds as linear_ticks.
std::vector<Tick> log_ticks(double low, double high, int most_labels = kMostLabels);

/// One or the other.
std::vector<Tick> ticks(AxisScale scale, double low, double high, int most_labels = kMostLabels);

}  // namespace sarnerf

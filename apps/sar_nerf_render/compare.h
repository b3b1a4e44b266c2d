// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "job.h"

namespace sarnerf::app {

/// Predicts the views of --against, and scores them beside what interpolation between the training images gives. With -o,
/// writes evaluation.json into that folder. Returns the table of means. Throws UsageError where nothing can be compared,
/// InputError for bad datasets.
std::string compare(const Job& job, Console& console, const Monitor& monitor);

}  // namespace sarnerf::app

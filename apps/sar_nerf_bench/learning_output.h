// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "learning.h"
#include "sarnerf/report/plot.h"

namespace sarnerf::bench {

/// PSNR against seconds. Of a field with runs of several planned times: what each run had reached at its
/// end, joined, and dashed the course of the longest; else the course of its run. Bars reach from the
/// worst seed to the best. The best baseline is a horizontal line.
Plot learning_diagram(const LearningStudy& study);

/// Two tables in Markdown: seconds to 30, 35, 40, 45 and 48 dB (and to what `plain` had in the end), and
/// the runs, means over seeds.
std::string learning_tables(const LearningStudy& study);

nlohmann::ordered_json learning_json(const LearningStudy& study);

}  // namespace sarnerf::bench

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "final_report.h"
#include "sarnerf/report/training_report.h"

namespace sarnerf::app {

/// The run as its report shows it.
TrainingReport report_of(const ReportInput& input, const Findings& findings);

}  // namespace sarnerf::app

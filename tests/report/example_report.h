// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sarnerf/report/training_report.h"

/// A report with every section: made-up figures, 24 held-out views and pictures of 64 × 48 pixels.
sarnerf::TrainingReport example_report();

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "job.h"

namespace sarnerf::app {

/// What a run of the program took: the only output that depends on clock and threads.
struct RunFigures {
  std::size_t n_rendered = 0;
  std::size_t n_reused = 0;  ///< views finished by an earlier run
  std::uint64_t n_hits = 0;
  double trace_and_deposit_s = 0.0;  ///< summed over views
  double formation_s = 0.0;
  double encode_s = 0.0;
  double write_s = 0.0;
  double total_s = 0.0;  ///< wall clock of the whole program so far
};

/// One line for people.
std::string summary(const RunFigures& figures);

/// The report as JSON.
std::string report_text(const Job& job, const RunFigures& figures);

}  // namespace sarnerf::app

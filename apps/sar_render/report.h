// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "job.h"
#include "products.h"

namespace sarnerf::app {

/// What a run of the program took: the only output that depends on clock and threads.
struct RunFigures {
  std::size_t n_rendered = 0;
  std::size_t n_reused = 0;  ///< views finished by an earlier run
  std::uint64_t n_hits = 0;
  std::vector<double> errors;        ///< estimated, of each view rendered that knows
  std::size_t n_unknown_errors = 0;  ///< views rendered that do not
  std::size_t n_repeated = 0;        ///< renders beyond one a view, for --error
  double trace_and_deposit_s = 0.0;  ///< summed over views
  double formation_s = 0.0;
  double encode_s = 0.0;
  double write_s = 0.0;
  double total_s = 0.0;  ///< wall clock of the whole program so far
};

/// Takes what one view gave.
void add(const Products& products, RunFigures& figures);

/// "error about 0.66 %", of all views rendered, and how many do not know theirs; empty before any is.
std::string error_line(const RunFigures& figures);

/// One line for people.
std::string summary(const RunFigures& figures);

/// The report as JSON.
std::string report_text(const Job& job, const RunFigures& figures);

}  // namespace sarnerf::app

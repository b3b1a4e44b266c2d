// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <mutex>
#include <optional>
#include <vector>

#include "checksums.h"
#include "display_scale.h"
#include "job.h"
#include "products.h"
#include "report.h"
#include "sweep_folder.h"
#include "warning_list.h"

namespace sarnerf::app {

/// The views of a sweep on their way into its folder: which are there, and making the others.
class SweepRun {
 public:
  /// Looks at what earlier runs of the same recipe wrote.
  SweepRun(const Job& job, const SweepFolder& folder);

  /// One flag per view: all of its files are there and whole.
  const std::vector<char>& finished() const { return finished_; }
  std::size_t n_finished() const;

  /// The scale of the pictures; known once render() has passed the views that it is taken from, or from the
  /// start when these are finished.
  const std::optional<DisplayScale>& display() const { return display_; }

  /// Renders the views that are not finished. Whatever ends it, finished() says what is there.
  RunFigures render(Console& console, const Monitor& monitor);

 private:
  std::vector<std::string> files_of(std::size_t view) const;
  void find_display(const Monitor& monitor);
  Products render_view(std::size_t view, const Monitor& monitor) const;
  void write(std::size_t view, Products products, const Monitor& monitor);

  const Job& job_;
  const SweepFolder& folder_;
  Checksums checksums_;
  std::vector<char> finished_;
  std::size_t n_open_;
  std::optional<DisplayScale> display_;
  std::map<std::size_t, Products> held_;  ///< rendered for the scale, not yet written
  WarningList warnings_;
  std::mutex mutex_;
  RunFigures figures_;
};

}  // namespace sarnerf::app

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "console.h"
#include "job.h"
#include "output_files.h"
#include "products.h"
#include "recipe_file.h"
#include "sarnerf/dataset/manifest.h"

namespace sarnerf::app {

/// Warnings of many views, each kind once, with the text of its first view. Threads may add.
class WarningList {
 public:
  void add(const ViewAngles& view, std::size_t index, const std::string& text);
  void print(Console& console) const;

 private:
  struct Entry {
    std::size_t n_views = 0;
    std::size_t first = 0;
    std::string text;
    double incidence_deg = 0.0, azimuth_deg = 0.0;
  };
  std::mutex mutex_;
  std::map<std::string, Entry> entries_;  ///< by the text without its figures
};

/// Writes the views of a sweep into its folder: finds the existing ones and renders the others.
class SweepRun {
 public:
  /// Finds the views that earlier runs of the same recipe wrote.
  SweepRun(const Job& job, const SweepFolder& folder);

  /// One flag per view: all of its files exist and are intact.
  const std::vector<char>& finished() const { return finished_; }
  std::size_t n_finished() const;

  /// The scale of the pictures; known once render() has rendered the views that determine it, or from the start when
  /// these are finished.
  const std::optional<DisplayScale>& display() const { return display_; }

  /// Renders the views that are not finished. However it ends, finished() reports which views exist.
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
  std::map<std::size_t, Products> held_;  ///< rendered for the pictures' scale, not yet written
  WarningList warnings_;
  std::mutex mutex_;
  RunFigures figures_;
};

/// Check before loading. Throws UsageError when other output is in the way, and Error when none can be written.
void check_sweep(const Options& options, const Json& request);

/// Renders the job's views into a dataset folder:
///
///     recipe.json            written first; the same recipe continues where an earlier run stopped
///     images/view_000.tif    each view's files appear whole, in any order
///     png/view_000.png
///     dataset.json           written last, the manifest
///     dataset.report.json    times
///
/// Existing views are not rendered again; the bytes of everything but the report do not depend on
/// threads or interruptions. Throws Interrupted after writing a manifest of the finished views. Returns
/// the manifest's path, one line.
std::string write_sweep(const Job& job, const Json& request, const Stopwatch& total, Console& console,
                        const Monitor& monitor);

/// Check before loading. Throws UsageError when other output is in the way, and Error when none can be written.
void check_single_view(const Options& options, const Json& request);

/// Renders the job's one view and writes NAME.tif, NAME.png, NAME.json and NAME.report.json, all or none;
/// or finds that this has been done. Returns the paths, one a line.
std::string write_single_view(const Job& job, const Json& request, const Stopwatch& total, Console& console,
                              const Monitor& monitor);

}  // namespace sarnerf::app

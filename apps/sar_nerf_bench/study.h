// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstddef>
#include <ctime>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "console.h"
#include "learning.h"
#include "process.h"
#include "sarnerf/core/parallel.h"
#include "sarnerf/dataset/posed_image.h"

namespace sarnerf::bench {

/// Each contestant with the times that its runs are planned for (s), ascending.
using Contest = std::vector<std::pair<std::string, std::vector<double>>>;

struct Options {
  std::filesystem::path training, against;
  Contest contest;
  int n_seeds = 1;
  std::size_t n_views = 16;
  std::filesystem::path output;
  bool overwrite = false;
  bool dry_run = false;  ///< print the runs and stop
  app::SharedOptions shared;
};

/// Empty when help or the version was asked for and has been printed. Throws UsageError.
std::optional<Options> parse_options(int argc, char** argv);

/// Wall-clock and processor seconds of a run. The clock stops while the run is scored.
class WorkClock {
 public:
  /// Begins as if it had run for `seconds` already, of which the processor worked `cpu_seconds`.
  WorkClock(double seconds, double cpu_seconds)
      : wall_s_(seconds), cpu_s_(cpu_seconds), wall_(now_s()), cpu_(now_cpu_s()) {}

  double seconds() const { return running_ ? wall_s_ + now_s() - wall_ : wall_s_; }
  double cpu_seconds() const { return running_ ? cpu_s_ + now_cpu_s() - cpu_ : cpu_s_; }

  void stop() {
    wall_s_ = seconds();
    cpu_s_ = cpu_seconds();
    running_ = false;
  }
  void go_on() {
    wall_ = now_s();
    cpu_ = now_cpu_s();
    running_ = true;
  }

  static double now_s() {
    return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch())
        .count();
  }
  static double now_cpu_s() {
    timespec now = {};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
    return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
  }

 private:
  double wall_s_, cpu_s_, wall_, cpu_;
  bool running_ = true;
};

/// The views on which all runs of a study are scored, read once before them.
struct Judge {
  std::vector<PosedImage> views;  ///< their acquisitions' aim is the origin
  double peak_power = 0.0;        ///< of the training images

  /// Mean over the views of the PSNR of power (dB).
  double psnr_db(const std::function<Image<float>(const Acquisition&)>& render) const;
};

/// Seconds before the first line of main(), which each run would have taken if it ran alone.
struct Loading {
  double seconds = 0.0, cpu_seconds = 0.0;
};

/// Trains every contestant for every time and seed, one after the other, shortest first. Each run reads the training
/// images and initialises its field anew; this counts as its time, as does `loading`. Calls `finished` with all
/// results so far after each run. A run that diverges ends there and is recorded as diverged.
///
/// A run is scored whenever its time has grown by a quarter, and at the end; its clock stops meanwhile. Except for
/// the last score, scoring takes no longer in total than learning.
///
/// Throws InputError for bad datasets, UsageError if the two do not belong together, Interrupted when the monitor asks for it.
void study_learning(const Options& options, const Loading& loading, app::Console& console,
                    const Monitor& monitor,
                    const std::function<void(const LearningStudy&)>& finished);

/// `sar_bench ablation`: see its --help. Prints the table.
void run_ablation(int argc, char** argv, app::Console& console);

}  // namespace sarnerf::bench

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>

#include "console.h"
#include "learning.h"
#include "options.h"
#include "sarnerf/core/monitor.h"
#include "sarnerf/dataset/posed_image.h"

namespace sarnerf::bench {

/// What all runs of a study are judged by, read once before them.
struct Judge {
  std::vector<PosedImage> views;  ///< their acquisitions' aim is the origin
  double peak_power = 0.0;        ///< of the training images

  /// Mean over the views of the PSNR of power (dB).
  double psnr_db(const std::function<Image<float>(const Acquisition&)>& render) const;
};

/// Seconds before the first line of main(), which each run would have spent alone.
struct Loading {
  double seconds = 0.0, cpu_seconds = 0.0;
};

/// Trains every contestant for every time and seed, one after the other, shortest first. Each run reads
/// the training images and initialises its field anew, and that counts as its time, as does `loading`.
/// `finished` is called with what is there after each run. A run that diverges ends there and says so.
///
/// A run is scored about every quarter of its time, and at the end; while that goes on its clock stands
/// still. Nor is a run scored for longer than it has learned, but for the last score.
///
/// Throws InputError for bad datasets, UsageError where the two do not belong together, Interrupted when
/// the monitor asks for it.
void study_learning(const Options& options, const Loading& loading, app::Console& console,
                    const Monitor& monitor,
                    const std::function<void(const LearningStudy&)>& finished);

}  // namespace sarnerf::bench

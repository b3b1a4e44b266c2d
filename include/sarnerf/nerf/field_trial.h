// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "sarnerf/core/parallel.h"
#include "sarnerf/nerf/training_set.h"

namespace sarnerf {

/// Rule of choose_field().
struct TrialRule {
  std::vector<std::string> fields{"surface", "grid"};  ///< the first one is chosen where there are too few views
  std::size_t n_held_out = 3;     ///< views that trials predict, spread over the set
  std::size_t least_views = 6;    ///< with fewer, too few would be left to learn from
  std::int64_t n_steps = 200;     ///< of each trial, with the whole schedule. Chosen: 100 mislead on one scene more of twelve
};

/// What a short training of one kind of field reached.
struct FieldTrial {
  std::string field;
  double psnr_power_db = 0.0;  ///< mean over the held-out views, 100 dB at most
  double seconds = 0.0;
  std::string failure;         ///< why it reached nothing; else empty
};

/// The kind of field that suits a training set, and why.
struct FieldChoice {
  std::string field;
  std::vector<FieldTrial> trials;      ///< empty: there were too few views
  std::vector<std::size_t> held_out;   ///< indices of the set's images that trials predicted
};

/// Chooses between an opaque surface and translucent voxels by a trial: each field is learned for a few steps from all views but
/// three, with its default options, and the one whose predictions of these three have the higher PSNR of power is chosen. Two
/// fields cannot be compared by their losses on training views: fog explains more images than a surface, wrong ones included.
///
/// A field whose trial diverges, or learns nothing, is not chosen unless all do. Deterministic for a seed and number of
/// threads. Throws Interrupted. Cost: two short trainings and six views: some 5 to 10 s.
FieldChoice choose_field(const TrainingSet& set, std::uint64_t seed = 1, const Monitor& monitor = {}, const TrialRule& rule = {});

/// One line for the user: "surface: 41.20 dB on 3 views held out from a trial of 200 steps (grid: 38.95 dB)".
std::string choice_text(const FieldChoice& choice, const TrialRule& rule = {});

}  // namespace sarnerf

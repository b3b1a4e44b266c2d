// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "sarnerf/nerf/learned_field.h"

namespace sarnerf::app {

/// The field that came closest to the held-out views so far, and whether it is still worth waiting for a better one:
/// --patience. Fields are judged at fixed shares of the schedule, not by the clock, so that a run goes on from a
/// checkpoint as if it had never stopped.
class BestModel {
 public:
  /// `patience`: the share of the schedule in which there must be a better one; 0: nothing is kept.
  explicit BestModel(double patience) : patience_(patience) {}

  bool due(double progress) const;
  void judge(const LearnedField& field, double psnr_db, double progress, std::int64_t step);
  bool worn_out(double progress) const;

  /// The best field, restored; none where nothing was judged.
  std::unique_ptr<LearnedField> field() const;
  std::int64_t step() const { return step_; }
  double psnr_db() const { return psnr_db_; }

  /// For a checkpoint and back. Throws CheckpointError for damaged contents; `where` names the file.
  void add_to(Archive& archive) const;
  void restore(const Archive& archive, const std::string& where);

 private:
  double patience_;
  int n_judged_ = 0;
  double psnr_db_ = 0.0, progress_ = 0.0;  ///< of the best one
  std::int64_t step_ = 0;
  std::optional<Archive> field_;
};

}  // namespace sarnerf::app

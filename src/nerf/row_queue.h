// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <random>
#include <vector>

#include "grid_learning.h"
#include "sarnerf/nerf/archive.h"
#include "sarnerf/nerf/learned_field.h"

namespace sarnerf {

/// Azimuth rows of all views in random order: each comes once before any comes again.
class RowQueue {
 public:
  struct Draw {
    RowReference row;
    double along_track_jitter, fan_jitter;  ///< in [0, 1)
  };

  RowQueue() = default;
  /// Empty until keep_rows_that_see().
  explicit RowQueue(std::uint64_t seed) : random_(seed) {}

  /// Begins anew with the rows that see the field's matter.
  void keep_rows_that_see(const TrainingSet& set, const LearnedField& field);

  bool empty() const { return rows_.empty(); }
  Draw next();

  /// Order, place and random state under "rows" and in the text.
  void save(Archive& archive) const;
  void restore(const Archive& archive, const std::string& where);

 private:
  std::mt19937_64 random_;
  std::vector<RowReference> rows_;
  std::size_t next_ = 0;
};

}  // namespace sarnerf

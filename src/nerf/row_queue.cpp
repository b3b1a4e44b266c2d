// SPDX-License-Identifier: Apache-2.0
#include "row_queue.h"

#include <sstream>

#include "archive_text.h"
#include "sarnerf/core/error.h"

namespace sarnerf {
namespace {

/// In [0, 1), the same on every platform.
double unit_random(std::mt19937_64& random) { return static_cast<double>(random() >> 11) * 0x1p-53; }

/// Fisher and Yates; std::shuffle differs from library to library.
void shuffle(std::vector<RowReference>& rows, std::mt19937_64& random) {
  for (std::size_t n = rows.size(); n > 1; --n)
    std::swap(rows[n - 1], rows[static_cast<std::size_t>(unit_random(random) * static_cast<double>(n))]);
}

}  // namespace

void RowQueue::keep_rows_that_see(const TrainingSet& set, const LearnedField& field) {
  rows_ = rows_that_see(set, field.occupied_box_m());
  next_ = rows_.size();
}

RowQueue::Draw RowQueue::next() {
  if (next_ == rows_.size()) {
    shuffle(rows_, random_);
    next_ = 0;
  }
  const RowReference row = rows_[next_++];
  const double along_track = unit_random(random_);
  return {row, along_track, unit_random(random_)};
}

void RowQueue::save(Archive& archive) const {
  torch::Tensor rows = torch::empty({static_cast<std::int64_t>(rows_.size()), 2}, torch::kLong);
  auto* out = rows.data_ptr<std::int64_t>();
  for (const RowReference& row : rows_) {
    *out++ = row.view;
    *out++ = row.row;
  }
  archive.tensors["rows"] = rows;
  std::ostringstream random;
  random << random_;
  add_text(archive, "row_queue", {{"next", next_}, {"random", random.str()}});
}

void RowQueue::restore(const Archive& archive, const std::string& where) {
  const torch::Tensor rows = archive.tensor("rows", torch::kLong, 2, where).contiguous();
  if (rows.size(1) != 2) throw CheckpointError(where + ": the order of the rows is damaged");
  const Json text = text_of(archive, "row_queue", where);
  rows_.clear();
  const auto* in = rows.data_ptr<std::int64_t>();
  for (std::int64_t n = 0; n < rows.size(0); ++n, in += 2)
    rows_.push_back({static_cast<std::uint32_t>(in[0]), static_cast<std::uint32_t>(in[1])});
  next_ = member<std::size_t>(text, "next", where);
  std::istringstream random(member<std::string>(text, "random", where));
  if (!(random >> random_) || next_ > rows_.size())
    throw CheckpointError(where + ": the order of the rows is damaged");
}

}  // namespace sarnerf

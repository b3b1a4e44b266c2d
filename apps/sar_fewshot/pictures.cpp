// SPDX-License-Identifier: Apache-2.0
// Pictures of chips, for the eye.
#include <algorithm>
#include <optional>

#include <nlohmann/json.hpp>

#include "clutter.h"
#include "generation.h"
#include "output_files.h"
#include "sarnerf/core/files.h"
#include "sarnerf/dataset/image_file.h"
#include "study.h"

namespace sarnerf::app {

namespace {

/// In decibels: up to eight chips of each set, evenly spread, a set in each row. `white`: the power of white; without one, each chip has its own.
Image<std::uint8_t> picture_of_rows(const std::vector<LabelledChips>& rows, std::optional<float> white) {
  constexpr int kColumns = 8, kGap_pixels = 2, kCell_pixels = kStoredSide + kGap_pixels;
  Image<std::uint8_t> picture(static_cast<int>(rows.size()) * kCell_pixels, kColumns * kCell_pixels, std::uint8_t{255});
  for (std::size_t r = 0; r < rows.size(); ++r) {
    const std::int64_t n = std::min<std::int64_t>(kColumns, rows[r].size());
    if (n == 0) continue;
    const torch::Tensor which = torch::floor_divide(torch::arange(n, torch::kInt64) * rows[r].size(), n);
    const std::vector<Image<float>> powers = powers_of({rows[r].amplitude.index_select(0, which), rows[r].label.index_select(0, which)});
    for (std::size_t column = 0; column < powers.size(); ++column) {
      const Image<std::uint8_t> levels =
          display_levels(powers[column], Quantity::power, white ? *white : white_level(powers[column]));
      for (int i = 0; i < kStoredSide; ++i)
        for (int j = 0; j < kStoredSide; ++j)
          picture(static_cast<int>(r) * kCell_pixels + i, static_cast<int>(column) * kCell_pixels + j) = levels(i, j);
    }
  }
  return picture;
}

/// Arms that have a row in pictures, joined ones as their parts. The shots alone generate nothing, measured chips have the first row, and
/// turned-360 and turned-both have other azimuths or more chips than the other rows.
std::vector<Arm> arms_with_rows(const Options& o) {
  std::vector<Arm> arms;
  for (const Arm arm : o.arms)
    for (const Arm part : {beside_turned(arm) ? Arm::turned : arm, beside_turned(arm).value_or(arm)})
      if (part != Arm::none && part != Arm::measured && part != Arm::turned_circle && part != Arm::turned_both &&
          std::ranges::find(arms, part) == arms.end())
        arms.push_back(part);
  return arms;
}

/// A picture for each class, in decibels on one scale: measured chips at the azimuths of generated ones, and below them what the arms make, as
/// classifiers get it; a row each, evenly spread.
std::vector<Image<std::uint8_t>> arms_pictures(const std::vector<ClassChips>& chips, const Draw& draw, const std::vector<Arm>& arms, const Options& o,
                                               const std::filesystem::path& cache, const Monitor& monitor) {
  Draw of_all_chips = draw;  // a picture may show test chips
  of_all_chips.test.assign(chips.size(), {});
  std::vector<LabelledChips> sets{generated_chips(Arm::measured, chips, of_all_chips, o, cache, monitor)};
  for (const Arm arm : arms) sets.push_back(generated_chips(arm, chips, draw, o, cache, monitor));
  std::vector<Image<std::uint8_t>> pictures;
  for (std::size_t c = 0; c < chips.size(); ++c) {
    float white = 0.0f;
    for (const std::size_t n : draw.shots[c]) white = std::max(white, white_level(chips[c].training[n].power));
    std::vector<LabelledChips> rows;
    for (const LabelledChips& set : sets) {
      const torch::Tensor members = torch::nonzero(set.label == static_cast<std::int64_t>(c)).flatten();
      rows.push_back({set.amplitude.index_select(0, members), set.label.index_select(0, members)});
    }
    pictures.push_back(picture_of_rows(rows, white));
  }
  return pictures;
}

}  // namespace

Pictures write_pictures(const Options& o, const std::vector<ClassChips>& chips, const Monitor& monitor) {
  const auto most = *std::ranges::max_element(o.shots);
  if (most == 0) return {};
  const Pictures result{arms_with_rows(o), o.exchange};
  if (result.rows.empty() && !result.exchanged) return result;
  const auto folder = o.output / "pictures", rows_file = folder / "rows.json";
  Json rows = {{"shots", most}, {"arms", Json::array()}};
  for (const Arm arm : o.arms) rows["arms"].push_back(name(arm));
  const std::string rows_text = rows.dump(1) + "\n";
  if (std::filesystem::exists(rows_file) && read_whole_file(rows_file) == rows_text) return result;
  const Draw draw = draw_shots(chips, most, 0, o);
  make_folder(folder);
  AtomicFiles files;
  if (o.exchange) {
    const TestChips test = test_of_classes(chips, draw, o);
    files.add(o.output / kExchangePicture, encode_png(picture_of_rows({test.measured, test.within, test.across}, {})));
  }
  if (!result.rows.empty()) {  // without rows, those of other commands stay
    const std::vector<Image<std::uint8_t>> pictures = arms_pictures(chips, draw, result.rows, o, o.output / "generated", monitor);
    for (std::size_t c = 0; c < chips.size(); ++c) files.add(o.output / picture_file(chips[c]), encode_png(pictures[c]));
    files.add(rows_file, rows_text);
  }
  files.commit();
  return result;
}

}  // namespace sarnerf::app

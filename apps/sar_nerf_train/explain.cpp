// SPDX-License-Identifier: Apache-2.0
#include "explain.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <set>

#include "sarnerf/core/format.h"
#include "sarnerf/dataset/background.h"

#include "values.h"

namespace sarnerf::app {
namespace {

std::string sizes_text(const std::vector<DatasetView>& views) {
  std::set<std::pair<int, int>> sizes;
  for (const DatasetView& v : views) sizes.insert({v.n_azimuth, v.n_range});
  const auto text = [](const std::pair<int, int>& s) {
    return std::to_string(s.first) + " x " + std::to_string(s.second);
  };
  return sizes.size() == 1 ? text(*sizes.begin())
                           : text(*sizes.begin()) + " to " + text(*sizes.rbegin()) + ", " +
                                 std::to_string(sizes.size()) + " sizes";
}

/// What the images show around the scene, and what follows.
std::string background_text(const TrainingSet& set) {
  if (set.tails_are_dark) return "tails of an impulse response, 40 dB below the brightest pixel: taken for dark";
  if (!set.clutter)
    return set.background ? "returns power, but is no level ground of clear texture: nothing is carved"
                                      : "dark: what lies in front of the first returns is empty";
  const Clutter& clutter = *set.clutter;
  std::uint64_t n_like = 0, n = 0;
  for (const Image<std::uint8_t>& like : clutter.like_ground) {
    n += like.pixels().size();
    for (const std::uint8_t l : like.pixels()) n_like += l;
  }
  return format("level ground%s, %.3g m %s the aim point, alone in %.0f %% of the pixels: rays end on it, errors count in "
                "proportion to brightness, matter may be up to %.3g m above it%s",
                clutter.speckled ? " under speckle" : "", std::abs(clutter.ground->height_m),
                clutter.ground->height_m < 0.0 ? "below" : "above",
                100.0 * static_cast<double>(n_like) / static_cast<double>(n), set.box_m.max.y - clutter.ground->height_m,
                clutter.speckled ? " (--scene-height)" : "");
}

}  // namespace

std::vector<std::pair<std::string, std::string>> left_out(const Options& o, const Data& data) {
  std::vector<std::pair<std::string, std::string>> list;
  if (data.validation.empty()) {
    list.emplace_back("held-out PSNR, baselines",
                      o.holdout.kind == Holdout::Kind::automatic
                          ? "fewer than 48 views: all are learned from (--holdout, --against)"
                          : "no view is held out (--holdout, --against)");
  }
  if (o.patience > 0.0 && data.validation.empty())
    list.emplace_back("early end", "no view is held out to tell when (--holdout, --against)");
  if (o.lpips.empty()) list.emplace_back("LPIPS", "no weights given (--lpips FILE, docs/lpips.md)");
  list.emplace_back("rows that see no matter",
                    "neither rendered nor learned from: they change nothing");
  list.emplace_back(
      "empty space",
      "voxels given up as they turn out to be empty, and those outside of what all views see");
  return list;
}

std::string explain(const Options& o, const Data& data, const Trainer& trainer) {
  std::string text = "plan\n";
  const auto line = [&](const std::string& name, const std::string& value) {
    text += "  " + name + std::string(name.size() < 18 ? 18 - name.size() : 1, ' ') + value + "\n";
  };
  line("learned from", std::to_string(data.training_views.size()) + " views of " +
                           o.dataset.string() + ", " + sizes_text(data.training_views) +
                           " pixels (azimuth x range)");
  line("predicted", data.validation.empty()
                        ? "none"
                        : std::to_string(data.n_held_out) + " held out, " +
                              std::to_string(data.validation.size() - data.n_held_out) +
                              " of --against");
  line("field",
       std::string(trainer.field().kind()) + ", to begin with " + trainer.field().size_text());
  line("background", background_text(trainer.set()));
  if (trainer.set().resolution)
    line("impulse response", resolution_text(*trainer.set().resolution) +
                                 (trainer.set().cleaned.empty() ? ": part of views, whose errors come back through it"
                                                                : ": taken out of the images, and part of views"));
  if (!trainer.set().resolution && o.resolution.or_else(data.dataset.resolution))
    line("impulse response", "left out: fewer than six speckled views do not tell a ground, or the spacing is too coarse for it");
  line("until", o.time_s ? std::to_string(*o.time_s) + " s after the program's start"
                         : std::to_string(o.steps) + " steps");
  line("a step", std::to_string(trainer.options().rows_per_step) + " azimuth rows of all views");
  std::uint64_t bytes = 0;
  for (const PosedImage& image : trainer.set().images) bytes += 4 * image.power.pixels().size();
  for (const PosedImage& image : data.validation) bytes += 4 * image.power.pixels().size();
  line("images", bytes_text(bytes) + " in memory");
  line("threads", std::to_string(o.shared.n_threads));
  for (const auto& [what, why] : left_out(o, data)) line("left out", what + ": " + why);
  line("output", o.run.string() + "/");
  text.pop_back();
  return text;
}

}  // namespace sarnerf::app

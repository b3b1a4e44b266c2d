// SPDX-License-Identifier: Apache-2.0
// Views of fields that are learned from the shots.
#include <optional>
#include <utility>

#include "generation.h"
#include "sarnerf/core/error.h"
#include "sarnerf/core/text.h"
#include "sarnerf/core/units.h"
#include "sarnerf/nerf/learned_field.h"
#include "sarnerf/nerf/trainer.h"
#include "study.h"
#include "torch_setup.h"

namespace sarnerf::app {

namespace {

/// What the fields of a draw share.
struct FieldContext {
  std::uint64_t seed = 1;
  double ground_height_m = 0.0;  ///< above the aim point
};

/// The box of a chip's swath about the aim point.
Box box_of(const Acquisition& a) {
  DatasetView view;
  view.incidence_deg = deg_from_rad(a.incidence_rad);
  view.slant_range_m = a.slant_range_m;
  view.n_azimuth = a.n_azimuth;
  view.n_range = a.n_range;
  view.azimuth_spacing_m = a.azimuth_spacing_m;
  view.range_spacing_m = a.range_spacing_m;
  return scene_box_of_swath(glm::dvec3(0.0), std::span(&view, 1));
}

/// Views of a field: means, without speckle. Each beside the field's view of the nearest shot, turned as the shot would be.
struct LearnedViews {
  std::vector<PosedImage> wanted, of_shots;
};

/// Of a field that is learned from the shots, which are too few to show the height of their ground: it is given.
LearnedViews learned_views(std::span<const PosedImage> shots, const std::vector<WantedView>& wanted, const GenerationOptions& o,
                           const FieldContext& context, const Monitor& monitor) {
  if (wanted.empty()) return {};
  use_torch_threads(1);
  GroundRule rule;
  rule.least_views = 2;
  rule.object_reach_pixels = kReachOfObject_pixels;
  TrainingSet set = training_set({shots.begin(), shots.end()}, box_of(shots.front().acquisition),
                                 {.ground_m = context.ground_height_m, .above_ground_m = {}}, {}, rule);
  TrainerOptions trainer_options = default_options(set, o.field);
  trainer_options.seed = context.seed;
  Trainer trainer(std::move(set), trainer_options, monitor);
  for (std::int64_t step = 0; step < o.field_steps; ++step) {
    monitor.check();
    trainer.step(static_cast<double>(step) / static_cast<double>(o.field_steps));
  }
  std::vector<PosedImage> at_shots;
  for (const PosedImage& shot : shots) at_shots.push_back({"", shot.acquisition, render_view(trainer.field(), shot.acquisition)});
  LearnedViews views;
  for (const WantedView& w : wanted) {
    monitor.check();
    views.wanted.push_back({"", w.acquisition, render_view(trainer.field(), w.acquisition)});
    views.of_shots.push_back(turned(at_shots[w.nearest], w.acquisition));
  }
  return views;
}

/// The height of the ground is estimated from the shots of all classes together; where they do not show it, the plane goes through the
/// aim point.
FieldContext field_context(const std::vector<ClassChips>& chips, const Draw& draw) {
  std::vector<std::vector<PosedImage>> scenes;
  for (std::size_t c = 0; c < chips.size(); ++c) scenes.push_back(shots_of(chips[c], draw.shots[c]));
  const Box box_m = box_of(scenes.front().front().acquisition);
  return {static_cast<std::uint64_t>(100'000 * draw.number + 1000 * draw.n_shots), common_ground_height_m(scenes, box_m).value_or(0.0)};
}

/// Of one class.
LearnedMeans means_of_field(const std::vector<ClassChips>& chips, const Draw& draw, std::size_t c, const Options& o, FieldContext context,
                            const Monitor& monitor) {
  context.seed += c;
  const std::vector<PosedImage> shots = shots_of(chips[c], draw.shots[c]);
  LearnedViews views = learned_views(shots, wanted_views(shots, o.generation, o.generation.depression_deg), o.generation, context, monitor);
  ViewsOfClasses wanted, of_shots;
  wanted.add(std::move(views.wanted), c);
  of_shots.add(std::move(views.of_shots), c);
  return {wanted.chips(), of_shots.chips()};
}

/// From the file, if it is whole and has this mark. Whatever else is there is made again.
std::optional<LearnedMeans> kept_means(const std::filesystem::path& file, const std::string& mark) {
  if (!std::filesystem::exists(file)) return std::nullopt;
  try {
    const Archive archive = read_archive(file);
    if (archive.json != mark) return std::nullopt;
    const auto chips_of = [&](const char* amplitude) {
      return LabelledChips{archive.tensor(amplitude, torch::kFloat32, 3, file.string()), archive.tensor("label", torch::kInt64, 1, file.string()),
                           archive.tensor("pose_deg", torch::kFloat64, 2, file.string())};
    };
    return LearnedMeans{chips_of("amplitude"), chips_of("of_shots")};
  } catch (const CheckpointError&) {
    return std::nullopt;
  }
}

void keep(const LearnedMeans& means, const std::filesystem::path& file, const std::string& mark) {
  Archive archive;
  archive.json = mark;
  archive.tensors = {{"amplitude", means.wanted.amplitude}, {"of_shots", means.of_shots.amplitude}, {"label", means.wanted.label},
                     {"pose_deg", means.wanted.pose_deg}};
  write_archive(file, archive);
}

}  // namespace

LearnedMeans learned_means(const std::vector<ClassChips>& chips, const Draw& draw, const Options& o, const std::filesystem::path& cache,
                          const Monitor& monitor) {
  constexpr int kFormat = 3;  // of the files
  const std::string mark = Json{{"study", study_of(o, chips, Arm::learned)}, {"format", kFormat}}.dump();
  std::optional<FieldContext> context;
  LearnedMeans all;
  for (std::size_t c = 0; c < chips.size(); ++c) {
    monitor.check();
    const auto file = cache / format("%02d_%02d_%s.pt", draw.n_shots, draw.number, chips[c].name.c_str());
    std::optional<LearnedMeans> means = kept_means(file, mark);
    if (!means) {
      if (!context) context = field_context(chips, draw);
      means = means_of_field(chips, draw, c, o, *context, monitor);
      keep(*means, file, mark);
      monitor.report(format("fields of draw %d", draw.number), c + 1, chips.size());
    }
    all = {joined(all.wanted, means->wanted), joined(all.of_shots, means->of_shots)};
  }
  return all;
}

}  // namespace sarnerf::app

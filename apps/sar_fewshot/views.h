// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "study.h"

/// The views of which the chips of arms are made: without a field in views.cpp, of fields in fields.cpp.
namespace sarnerf::app {

/// A view to generate, the shot nearest to it, and the one on the other side of it.
struct WantedView {
  Acquisition acquisition;
  std::size_t nearest = 0, farther = 0;
};

/// Views that divide each gap between neighbouring shots evenly, in steps of about `step_deg`, without those that are farther from a shot
/// than the reach. At another depression than the shots', also at their azimuths.
std::vector<WantedView> wanted_views(std::span<const PosedImage> shots, const GenerationOptions& options, std::optional<double> depression_deg);

/// Arm::turned_circle turns a shot by equal steps, of which this many make a circle.
inline constexpr int kTurnsOfCircle = 24;

/// A shot, turned on the level plane and rescaled in range.
PosedImage turned(const PosedImage& shot, const Acquisition& wanted);

/// The shots of one class.
std::vector<PosedImage> shots_of(const ClassChips& chips, const std::vector<std::size_t>& which);

/// Views of all classes, one class after the other.
class ViewsOfClasses {
 public:
  void add(std::vector<PosedImage> of_class, std::size_t c);
  LabelledChips chips() const;

 private:
  std::vector<PosedImage> views_;
  std::vector<std::int64_t> labels_;
};

/// The views of an arm that needs no field, of all classes.
LabelledChips views_of_classes(Arm arm, const std::vector<ClassChips>& chips, const Draw& draw, const Options& options, const Monitor& monitor);

/// Means that the fields of all classes predict, without speckle: of the wanted views, and of the nearest shots, turned as the shots would be.
struct LearnedMeans {
  LabelledChips wanted, of_shots;
};

/// From a file in `cache`, which is written if there is none of this study: fields take long.
LearnedMeans learned_means(const std::vector<ClassChips>& chips, const Draw& draw, const Options& options, const std::filesystem::path& cache,
                           const Monitor& monitor);

}  // namespace sarnerf::app

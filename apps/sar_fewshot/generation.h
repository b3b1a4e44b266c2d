// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <vector>

#include "chips.h"

/// The chips that arms add to the shots (generation.cpp), and the views of which they are made: without a field in views.cpp, of fields in
/// fields.cpp.
namespace sarnerf::app {

/// No more chips than so many does an arm generate in a draw. An estimate for memory, in which all views lie within the reach.
std::size_t most_generated(Arm arm, const Draw& draw, const GenerationOptions& options);

/// Chips of an arm beside the draw's shots; none for Arm::none. Views divide each gap between neighbouring shots evenly, in steps of about
/// `step_deg`, and lie at most `reach_deg` from the nearer shot.
LabelledChips generated_chips(Arm arm, const std::vector<ClassChips>& chips, const Draw& draw, const Options& options,
                              const std::filesystem::path& cache, const Monitor& monitor);

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

/// From files in `cache`, one of each class, which are written if there are none of this study: a field takes seconds to minutes. The
/// same chips, options, processor and number of threads repeat it exactly. Throws Interrupted, and Error for a file that cannot be written.
LearnedMeans learned_means(const std::vector<ClassChips>& chips, const Draw& draw, const Options& options, const std::filesystem::path& cache,
                           const Monitor& monitor);

}  // namespace sarnerf::app

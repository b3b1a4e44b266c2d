// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "console.h"
#include "sarnerf/render/engine.h"
#include "sarnerf/report/plot.h"
#include "sarnerf/scene/scene.h"

namespace sarnerf::bench {

/// Options common to all studies.
struct StudyOptions {
  std::vector<std::string> scene_files;  ///< rendered at 45° from 10 km unless said otherwise
  LoadOptions load;
  double pitch_deg = 45.0;
  double azimuth_deg = 20.0;
  double spacing_m = 0.3;
  int size = 128;
  int rounds = 15;
  bool quick = false;
  std::string render_flags;  ///< passed on to sar_render by study_sweep
};

/// Tracing and deposit against bare Embree over the same kept rays, and whole views against bare
/// single-ray tracing of the full ray grid; one entry a scene. One thread.
nlohmann::json study_engine(const StudyOptions& options);

/// Both engines on one thread and on several, with voxels of one range bin: one entry a scene.
nlohmann::json study_threads(const StudyOptions& options, int n_threads);

/// Tracing and deposit of a mesh of 12 thousand and one of 1.2 million triangles, same shape and rays.
nlohmann::json study_triangles(const StudyOptions& options);

/// A 1024 × 1024 image of a million triangles: seconds, and the peak memory of the whole process.
nlohmann::json study_large_image(const StudyOptions& options);

/// A sweep of 360 views with TIFF and PNG by the sar_render beside this program: whole process, all
/// threads, one entry a scene file.
nlohmann::json study_sweep(const StudyOptions& options);

/// Integrators, forward and adjoint, for each instruction set of this processor: ns a segment.
nlohmann::json study_integrators(const StudyOptions& options);

/// The voxel engine beside the surface engine: time, error, voxels and memory at one bin to an eighth, slope
/// of the error, the dense march of the same rays, and what doubling the empty space changes. One thread.
nlohmann::json study_voxel(const StudyOptions& options);

/// Machine, compiler, revision, threads: printed with every result.
nlohmann::json environment();

/// Seconds of repeated runs, with the robust statistics that are reported.
struct Timing {
  std::vector<double> seconds;
  double quantile(double q) const;
  double median() const { return quantile(0.5); }
};

/// Runs all contenders in turn, `rounds` times after one warm-up, so that drift of the machine affects them alike:
/// ratios between them are more reliable than their times.
std::vector<Timing> run_in_turn(const std::vector<std::function<void()>>& contenders, int rounds);

/// Median of a / b, pair by pair.
double ratio(const Timing& a, const Timing& b);

/// Median and quartiles of a / b, pair by pair.
nlohmann::json ratio_json(const Timing& a, const Timing& b);

/// Median and quartiles, in nanoseconds for each of `count` items.
nlohmann::json nanoseconds_json(const Timing& timing, double count);

struct NamedScene {
  std::string name;
  Scene scene;
};

/// The scenes named in the options, or two generated ones.
std::vector<NamedScene> load_scenes(const StudyOptions& options);

/// The view that all studies take, centred on the scene.
Acquisition standard_view(const Scene& scene, const StudyOptions& options);

/// A closed, bumpy sphere of about `n_triangles` and the given mean radius (m), standing on y = 0: the
/// same shape at every resolution, so that only the number of triangles changes.
Scene bumpy_sphere(std::uint64_t n_triangles, double radius_m);

/// Another program of the same build or installation. Throws Error if it is missing.
std::filesystem::path program_beside(const std::string& name);

/// The text quoted as one word of a shell's line, whatever characters it has.
std::string quoted(const std::string& word);

/// Runs such a program, discards its stdout, and waits for it. Returns its exit code; throws Interrupted if it was
/// told to stop.
int run_beside(const std::string& name, const std::vector<std::string>& arguments);

/// One setting of one scene: its cost, and its error against the reference.
struct Accuracy {
  std::string engine;
  std::string integrator = "exact";
  double voxel_bins = 0.0;  ///< side in range bins; 0 for the surface engine
  int n_elevation = 0, n_slices = 0;
  bool automatic = false;
  double seconds = 0.0;
  double error = 0.0;       ///< E against the reference
  double db_error = 0.0;    ///< 95th percentile within 30 dB of the peak
  double estimate = 0.0;    ///< of E, by the render itself
  double estimating = 1.0;  ///< time with the estimate over time without
};

/// Result of a render with a tolerance (--error).
struct ToleranceResult {
  double tolerance = 0.0;
  int n_elevation = 0, n_slices = 0, n_renders = 0;
  double seconds = 0.0;  ///< pilots included
  double estimate = 0.0, error = 0.0;
  double n_rays = 0.0;   ///< elevations × slices a row, pilots included: a cost independent of the clock
  double best_n_rays = std::numeric_limits<double>::quiet_NaN();  ///< least of a swept setting that meets the tolerance
  double best_s = std::numeric_limits<double>::quiet_NaN();  ///< of the fastest swept setting that meets the tolerance
};

struct SceneAccuracy {
  std::string scene;
  std::vector<Accuracy> settings;
  std::vector<ToleranceResult> tolerances;
};

/// Error against time of every setting, for each scene, against a converged reference; and the results of --error. One thread.
std::vector<SceneAccuracy> study_accuracy(const StudyOptions& options);

nlohmann::json accuracy_json(const std::vector<SceneAccuracy>& results);

/// `sar_bench learning …` and `ablation …`: becomes the sar_nerf_bench of the same build or installation, with the
/// arguments from `first` on. That is a separate program because this one does not load LibTorch. Returns only by
/// throwing Error, if that program is missing.
[[noreturn]] void become_nerf_bench(int argc, char** argv, char** first);

/// The work–precision diagram of one scene: error over time of every setting, both logarithmic, with the
/// Pareto-optimal settings joined by a line.
Plot accuracy_diagram(const SceneAccuracy& scene);

/// Scenes by settings, as Markdown: results of the automatic setting, coarser and finer ones, and tolerances.
std::string accuracy_table(const std::vector<SceneAccuracy>& scenes);

// Presentation of results.

struct PageOptions {
  std::filesystem::path input, output;
  bool quiet = false;
};

/// Writes a Markdown file as one HTML page (page_of_markdown()). Pictures are files relative to it; those of a dataset's images
/// (float32) are shown in decibels.
void run_page_command(const PageOptions& options, app::Console& console);

struct CurvesOptions {
  std::vector<std::string> methods;  ///< NAME=RUN[,RUN...]
  std::filesystem::path picture;
  std::string title = "PSNR of unseen views while learning";
  bool by_steps = false, quiet = false;
};

/// Prints a Markdown table of the held-out PSNR of runs of sar_nerf_train after halves of the longest time: the mean of a method's
/// runs, and their least and largest. Draws the same as curves into a PNG. Values between two scores are linear in the logarithm of
/// the time. Throws InputError for runs without held-out scores.
void run_curves_command(const CurvesOptions& options, app::Console& console);

struct StripOptions {
  std::vector<std::filesystem::path> datasets;
  std::filesystem::path trained, output;
  int zoom = 1;
  bool with_difference = false, quiet = false;
};

/// Writes a picture of the views of several datasets: those of the first from left to right, each above the same view (azimuth and
/// incidence to 0.01 degrees) of the others, and with `with_difference` above the magnitude of the difference of the first two. White
/// is the 99.9th percentile of the first dataset's brightest view. Frames mark views that `trained` has; a dataset of predictions need
/// not have these. Throws UsageError where another view is missing, or of another size.
void run_strip_command(const StripOptions& options, app::Console& console);

struct ExtentsOptions {
  std::vector<std::filesystem::path> datasets;
  bool quiet = false;
};

/// Prints a Markdown table of each view's extents in slant range (m) along the image's middle row: wall, roof and shadow, from the
/// layers that sar_render --layers wall,roof,mask wrote, and of ‖I − I₁‖₂ / ‖I₁‖₂ against the same view I₁ of the first dataset. A bin
/// counts where a component's brightness exceeds half of its median, so an extent is wrong by one bin at most.
void run_extents_command(const ExtentsOptions& options, app::Console& console);

}  // namespace sarnerf::bench

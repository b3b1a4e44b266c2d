// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <filesystem>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "sarnerf/core/image.h"
#include "sarnerf/core/impulse_response.h"
#include "sarnerf/core/parallel.h"
#include "sarnerf/geometry/acquisition.h"

namespace sarnerf {

/// What a pixel measures: linear power, or its square root.
enum class Quantity { power, amplitude };

/// The area that backscatter is divided by.
enum class Calibration {
  beta0,         ///< pixel area in the slant plane: radar brightness
  sigma0,        ///< pixel area on the reference plane: β⁰ sin θ_j
  gamma0,        ///< the same seen from the radar: β⁰ tan θ_j
  uncalibrated,  ///< unknown factor; for read data only
};

std::string_view name(Quantity quantity);
std::string_view name(Calibration calibration);

/// Inverses of name(). Throw UsageError listing the names that exist.
Quantity quantity_from_name(std::string_view name);
Calibration calibration_from_name(std::string_view name);

/// Turns β⁰ (linear power, [n_azimuth × n_range]) into σ⁰ or γ⁰ in place:
///
///     σ⁰ = β⁰ sin θ_j    γ⁰ = β⁰ tan θ_j    cos θ_j = H / r_j
///
/// with H (m) the radar's height above the reference plane at `reference_height_m` (world). Bins nearer
/// than H lie above the plane's nadir, where θ_j does not exist; there θ_j = 0 and both vanish.
/// Returns the number of such bins. Throws GeometryError when the radar stands below the plane, and
/// UsageError for `uncalibrated`.
int calibrate(Image<float>& beta0, const Acquisition& acquisition, double reference_height_m,
              Calibration calibration);

/// Throws what calibrate() would.
void require_calibration(const Acquisition& acquisition, double reference_height_m, Calibration calibration);

/// Converts power to amplitude in place.
void take_amplitude(Image<float>& power);

/// Angles are often published rounded to hundredths: larger differences mean different geometries.
inline constexpr double kSameAngle_deg = 0.0101;

/// What a file's rows or columns run along: azimuth rows i or slant-range bins j, forwards or backwards.
enum class Axis { plus_i, minus_i, plus_j, minus_j };

/// One image of a dataset and how it was taken. Angles in degrees, as in the file: what the user wrote
/// as 45 stays 45.
struct DatasetView {
  std::string image;  ///< path relative to the dataset's folder
  double azimuth_deg = 0.0;
  double incidence_deg = 0.0;  ///< at the aim point, from the vertical; depression is 90 minus this
  double slant_range_m = 0.0;
  std::optional<double> altitude_m;  ///< of the radar above the aim point
  int n_azimuth = 0;
  int n_range = 0;
  double azimuth_spacing_m = 0.0;
  double range_spacing_m = 0.0;
  std::array<Axis, 2> axes{Axis::plus_i, Axis::plus_j};  ///< of the file's rows and columns
  Look look = Look::right;
  std::string class_name, serial, source;  ///< empty: unknown

  double depression_deg() const { return 90.0 - incidence_deg; }
};

/// Whether two views have the same azimuth and incidence, to a millionth of a degree, and the same look side.
bool same_angles(const DatasetView& a, const DatasetView& b);

/// A folder of images that show one scene, described by its dataset.json.
struct Dataset {
  Quantity quantity = Quantity::power;
  Calibration calibration = Calibration::beta0;
  double scale = 1.0;  ///< physical value = stored value or code × scale
  glm::dvec3 aim_m{0.0};
  Box scene_box_m;  ///< extent of the swaths; see scene_box_of_swath
  /// Whether the views' poses are exact to a hundredth of a pixel. Simulated ones are; those of measured chips are not,
  /// since chips are cut about the target.
  bool exact_poses = false;
  std::optional<Resolution> resolution;  ///< of the impulse response of all images; empty: unknown, or no response applied
  std::vector<DatasetView> views;
  std::size_t n_planned_views = 0;  ///< final number of views of an interrupted sweep; 0: all views exist
  std::map<std::string, std::vector<std::string>> splits;  ///< name to images, disjoint
  std::string provenance_json = "{}";  ///< a JSON object, kept as it is

  bool unfinished() const { return n_planned_views > views.size(); }
};

/// Message about an unfinished dataset and how to finish it, "31 of 576 views: …"; empty for a complete one.
std::string unfinished_text(const Dataset& dataset);

/// Name of the manifest in a dataset's folder.
inline constexpr std::string_view kManifestName = "dataset.json";

/// The acquisition of a view, in radians.
Acquisition acquisition_of(const DatasetView& view, const glm::dvec3& aim_m);

/// The part of the world that the views' swaths see, from the acquisitions alone (a box taken from the
/// mesh would reveal the scene's extent to the field):
///
///     x, z   aim ± ½ hypot(n_az Δa, n_rg Δr / sin θ)
///     y      from the aim to ½ n_rg Δr / cos θ above it
///
/// the largest over the views. Throws UsageError without views.
Box scene_box_of_swath(const glm::dvec3& aim_m, std::span<const DatasetView> views);

/// The text of a manifest: one view a line, the same bytes for the same dataset. Throws UsageError for
/// a dataset that parse_manifest would refuse.
std::string manifest_text(const Dataset& dataset);

/// One view as the JSON object that a manifest holds for it.
std::string view_text(const DatasetView& view);

/// Reads and validates a manifest; `where` names it in messages. Throws InputError with the location
/// ("dataset.json: views[3].look: …") for syntax, unknown or missing keys, wrong types, a version from
/// the future, values out of range, both angles missing or contradicting each other, an altitude that
/// contradicts range and angle, images outside of the folder or listed twice, and splits that overlap.
Dataset parse_manifest(std::string_view text, const std::string& where);

/// parse_manifest on the dataset.json of a folder. If there is none, the InputError reports whether a program was stopped
/// before it wrote one.
Dataset read_manifest(const std::filesystem::path& folder);

/// SHA-256 of a dataset: of its manifest and its images in the manifest's order, in the form
///
///     sha256sum dataset.json IMAGE… | sha256sum
///
/// so that a model can name the dataset it was trained on. Throws InputError for a file that cannot be read, Interrupted when
/// the monitor asks for it. Cost: reading all images, in parallel.
std::string dataset_fingerprint(const std::filesystem::path& folder, const Dataset& dataset,
                                const Monitor& monitor = {});

}  // namespace sarnerf

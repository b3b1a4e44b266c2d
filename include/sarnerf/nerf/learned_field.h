// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <torch/types.h>

#include "sarnerf/core/image.h"
#include "sarnerf/core/impulse_response.h"
#include "sarnerf/geometry/acquisition.h"
#include "sarnerf/mpa/integrate.h"
#include "sarnerf/nerf/row_renderer.h"

namespace sarnerf {

/// Contents of model and checkpoint files: named tensors, and everything else as one JSON object.
struct Archive {
  std::string json = "{}";
  std::map<std::string, torch::Tensor> tensors;

  /// A tensor of this name, type and number of dimensions. Throws CheckpointError, naming `where`, if there is none.
  const torch::Tensor& tensor(const std::string& name, torch::ScalarType type, std::int64_t n_dimensions,
                              const std::string& where) const;
};

/// Writes a temporary file in the same folder and renames it: readers see either the old file or the complete new one.
/// The format is LibTorch's own pickled dictionary of name to tensor, with the text under "json". LibTorch 1.13 and 2.x
/// and Python's torch.load() read it. Throws Error when the disk is full.
void write_archive(const std::filesystem::path& path, const Archive& archive);

/// Throws CheckpointError for a file that is missing, truncated, damaged, or something else.
Archive read_archive(const std::filesystem::path& path);

/// Whether a kind of field (LearnedField::kind()) is a network, "mlp" or "paper": LibTorch computes it, on all threads.
inline bool is_network(std::string_view kind) { return kind == "mlp" || kind == "paper"; }

/// A scene that is learned from images: extinction and directional brightness in space. Its frame is world axes
/// centred on the aim point.
class LearnedField {
 public:
  virtual ~LearnedField() = default;

  /// "grid", "mlp", "paper" or "surface".
  virtual std::string_view kind() const = 0;

  /// β⁰ of azimuth rows, concatenated, [Σ n_range] float32, differentiable by the parameters. The field must not change
  /// before the backward pass.
  virtual torch::Tensor render_rows(std::span<const RowRequest> rows, const RaySampling& sampling) const = 0;

  /// The same without derivatives.
  virtual void render_rows(std::span<const RowRequest> rows, const RaySampling& sampling,
                           std::span<float> pixels) const = 0;

  /// The tensors that an optimiser updates.
  virtual std::vector<torch::Tensor> parameters() const = 0;

  /// Box of the occupied voxels: rows and rays that miss it do not depend on the field.
  virtual Box occupied_box_m() const = 0;

  /// Integrator of its segments. The field was learned with it, and renders correctly with no other.
  virtual Integrator integrator() const { return Integrator::exact; }

  /// Unit of the sampling's lengths.
  virtual double voxel_size_m() const = 0;

  /// The field's size, as `--explain` and progress report it: "35,080 voxels of 0.2 m".
  virtual std::string size_text() const = 0;

  /// Resolution of the radar that made the images, if the field is the scene without its impulse response.
  std::optional<Resolution> resolution;

  /// The archive from which restore_field() restores it.
  virtual Archive state() const = 0;
};

/// Two-way optical depth at which the rays of render_view() end: e^−depth of a ray's power lies behind. The field `paper` has no end.
double end_depth_of_views(const LearnedField& field);

/// A view at the sampling of evaluation: rays every half voxel, three slices per row. If the field has an impulse response, it
/// is applied, with the power that leaks in from beyond the image. The field `paper` may have power below 0, which counts as 0.
Image<float> render_view(const LearnedField& field, const Acquisition& acquisition);

/// The same without an impulse response: the mean reflectivity that image formation starts from.
Image<float> render_sharp_view(const LearnedField& field, const Acquisition& acquisition);

/// The field of a model file. Throws CheckpointError for an unknown kind, another version, or damaged contents.
std::unique_ptr<LearnedField> restore_field(const Archive& archive, const std::string& where);

}  // namespace sarnerf

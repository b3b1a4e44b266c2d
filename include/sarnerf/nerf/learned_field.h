// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <torch/types.h>

#include <memory>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "sarnerf/core/image.h"
#include "sarnerf/core/impulse_response.h"
#include "sarnerf/geometry/box.h"
#include "sarnerf/mpa/integrator.h"
#include "sarnerf/nerf/archive.h"
#include "sarnerf/nerf/row_renderer.h"

namespace sarnerf {

/// A scene that is learned from images: extinction and directional brightness in space. Its frame is world axes
/// centred on the aim point.
class LearnedField {
 public:
  virtual ~LearnedField() = default;

  /// "grid" or "mlp".
  virtual std::string_view kind() const = 0;

  /// β⁰ of azimuth rows one behind the other, [Σ n_range] float32, differentiable by the parameters. The field must
  /// not change before the backward pass.
  virtual torch::Tensor render_rows(std::span<const RowRequest> rows, const RaySampling& sampling) const = 0;

  /// The same without derivatives.
  virtual void render_rows(std::span<const RowRequest> rows, const RaySampling& sampling,
                           std::span<float> pixels) const = 0;

  /// What an optimiser moves.
  virtual std::vector<torch::Tensor> parameters() const = 0;

  /// Where matter may be: rows and rays that miss this box render nothing.
  virtual Box occupied_box_m() const = 0;

  /// Rule by which its segments become images: it was learned by that one, and looks right by no other.
  virtual Integrator integrator() const { return Integrator::exact; }

  /// What sampling is measured in.
  virtual double voxel_size_m() const = 0;

  /// What `--explain` and progress tell of the field: "35,080 voxels of 0.2 m".
  virtual std::string size_text() const = 0;

  /// Of the radar that made the images, where the field is the scene without its impulse response.
  std::optional<Resolution> resolution;

  /// Everything that restores it: see restore_field().
  virtual Archive state() const = 0;
};

/// A view at the sampling that evaluation uses: rays every half voxel, three to a row; through the field's impulse response,
/// where it has one, with what leaks in from beyond the image.
Image<float> render_view(const LearnedField& field, const Acquisition& acquisition);

/// The field of a model file. Throws CheckpointError for an unknown kind, another version, or damaged contents.
std::unique_ptr<LearnedField> restore_field(const Archive& archive, const std::string& where);

}  // namespace sarnerf

// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/nerf/grid_field.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include <torch/csrc/autograd/custom_function.h>

#include "field/rows.h"
#include "field/tensors.h"
#include "sarnerf/core/parallel.h"
#include "sarnerf/core/text.h"
#include "sarnerf/field/field_sampler.h"

namespace sarnerf {

namespace {

constexpr std::size_t kGrain = 1 << 12;  ///< voxels that a thread takes at a time

}  // namespace

GridField::GridField(const GridTransform& transform, int harmonics_degree, double source_scale)
    : transform_(transform), channels_{false, harmonics_degree, SourceBasis::harmonics},
      source_scale_(source_scale) {}

void GridField::set_voxels(BrickTopology topology, std::span<const std::uint8_t> active,
                           const torch::Tensor& new_log_depth, const torch::Tensor& new_coefficients) {
  topology_ = std::move(topology);
  active_.clear();
  std::vector<float> occupied(active.size(), 0.0f);
  for (std::size_t v = 0; v < active.size(); ++v) {
    if (active[v] == 0) continue;
    active_.push_back(static_cast<std::uint32_t>(v));
    occupied[v] = 1.0f;
  }
  occupancy_ = std::make_unique<Occupancy>(BrickView<const float>{&topology_, transform_, 1, occupied}, 1);
  idle_memory_ = std::make_shared<std::vector<Memory>>();
  const auto take = [](torch::Tensor& parameter, const torch::Tensor& value) {
    if (parameter.defined()) {
      parameter.set_data(value.detach().contiguous());
      parameter.mutable_grad() = torch::Tensor();
    } else {
      parameter = value.detach().contiguous().set_requires_grad(true);
    }
  };
  take(log_depth, new_log_depth);
  take(coefficients, new_coefficients);
}

std::vector<float> GridField::values() const {
  std::vector<float> out;
  values(out);
  return out;
}

void GridField::values(std::vector<float>& values) const {
  const auto n_source = static_cast<std::size_t>(channels_.n_source());
  const std::size_t n_channels = n_source + 1;
  if (values.size() != n_voxels() * n_channels) values.assign(n_voxels() * n_channels, 0.0f);
  const float* a = log_depth.data_ptr<float>();
  const float* b = coefficients.data_ptr<float>();
  const auto density = static_cast<float>(0.5 / transform_.voxel_size_m);
  const auto scale = static_cast<float>(source_scale_);
  parallel_for(active_.size(), kGrain, [&](std::size_t begin, std::size_t end, int) {
    for (std::size_t n = begin; n < end; ++n) {
      float* const out = &values[active_[n] * n_channels];
      out[0] = density * std::exp(a[n]);
      for (std::size_t m = 0; m < n_source; ++m) out[1 + m] = scale * b[n * n_source + m];
    }
  });
}

void GridField::parameter_gradients(std::span<const float> d_active, float* d_log_depth,
                                    float* d_coefficients) const {
  const auto n_source = static_cast<std::size_t>(channels_.n_source());
  const float* a = log_depth.data_ptr<float>();
  const auto density = static_cast<float>(0.5 / transform_.voxel_size_m);
  const auto scale = static_cast<float>(source_scale_);
  parallel_for(active_.size(), kGrain, [&](std::size_t begin, std::size_t end, int) {
    for (std::size_t n = begin; n < end; ++n) {
      const float* const in = &d_active[n * (n_source + 1)];
      d_log_depth[n] = in[0] * density * std::exp(a[n]);  // dκ/da = κ
      for (std::size_t m = 0; m < n_source; ++m) d_coefficients[n * n_source + m] = scale * in[1 + m];
    }
  });
}

std::string GridField::size_text() const {
  return format("%zu voxels of %.3g m", n_active(), transform_.voxel_size_m);
}

torch::Tensor prune(GridField& field, std::span<const std::uint8_t> keep) {
  std::vector<std::uint8_t> kept(field.n_voxels(), 0);
  std::vector<std::int64_t> places;
  for (std::size_t n = 0; n < keep.size(); ++n) {
    if (keep[n] == 0) continue;
    kept[field.active_voxels()[n]] = 1;
    places.push_back(static_cast<std::int64_t>(n));
  }
  BrickTopology topology;
  std::vector<std::uint8_t> active;
  for (std::uint32_t brick = 0; brick < field.topology().n_bricks(); ++brick) {
    const auto mine = std::span(kept).subspan(std::size_t{brick} * kBrickVoxels, kBrickVoxels);
    if (std::all_of(mine.begin(), mine.end(), [](auto k) { return k == 0; })) continue;
    topology.insert(field.topology().coordinate(brick));
    active.insert(active.end(), mine.begin(), mine.end());
  }
  const auto index = torch::tensor(places, torch::kLong);
  field.set_voxels(std::move(topology), active, field.log_depth.detach().index_select(0, index),
                   field.coefficients.detach().index_select(0, index));
  return index;
}

GridField refined(const GridField& field) {
  // The centres of voxel (0,0,0) of both grids coincide.
  const GridTransform transform{field.transform().origin_m, 0.5 * field.transform().voxel_size_m};
  GridField fine(transform, field.channels().harmonics_degree, field.source_scale());
  fine.ground = field.ground;
  fine.resolution = field.resolution;
  const auto n_source = static_cast<std::size_t>(field.channels().n_source());

  // The logarithm of the depth and the coefficients are interpolated between active voxels only: channel 0 holds the
  // weight of the active ones, by which the others are normalised.
  const std::size_t n_channels = 2 + n_source;
  std::vector<float> coarse(field.n_voxels() * n_channels, 0.0f);
  const float* a = field.log_depth.data_ptr<float>();
  const float* b = field.coefficients.data_ptr<float>();
  for (std::size_t n = 0; n < field.n_active(); ++n) {
    float* c = &coarse[field.active_voxels()[n] * n_channels];
    c[0] = 1.0f;
    c[1] = a[n];
    for (std::size_t m = 0; m < n_source; ++m) c[2 + m] = b[n * n_source + m];
  }
  const BrickView<const float> coarse_view{&field.topology(), field.transform(), static_cast<int>(n_channels),
                                           coarse};
  BrickTopology topology;
  const Occupancy& occupancy = field.occupancy();
  for (std::uint32_t brick = 0; brick < occupancy.bricks().n_bricks(); ++brick) {
    const glm::ivec3 origin = occupancy.bricks().coordinate(brick) * kBrickSide;
    for (int n = 0; n < kBrickVoxels; ++n) {
      const glm::ivec3 cell = origin + voxel_in_brick(n);
      if (!occupancy.cell(brick, cell)) continue;
      for (int c = 0; c < 8; ++c) {
        const glm::ivec3 voxel = 2 * cell + glm::ivec3(c >> 2, c >> 1 & 1, c & 1);
        if (topology.find(brick_of_voxel(voxel)) == kNoBrick) topology.insert(brick_of_voxel(voxel));
      }
    }
  }
  const std::size_t n_voxels = topology.n_bricks() * kBrickVoxels;
  std::vector<std::uint8_t> active(n_voxels, 0);
  std::vector<float> fa(n_voxels), fb(n_voxels * n_source);
  parallel_for(topology.n_bricks(), 8, [&](std::size_t begin, std::size_t end, int) {
    TrilinearSampler sampler(coarse_view);
    std::vector<glm::vec3> points(kBrickVoxels);
    std::vector<float> out(kBrickVoxels * n_channels);
    for (std::size_t brick = begin; brick < end; ++brick) {
      const glm::ivec3 origin = topology.coordinate(static_cast<std::uint32_t>(brick)) * kBrickSide;
      for (int n = 0; n < kBrickVoxels; ++n)
        points[static_cast<std::size_t>(n)] = glm::vec3(transform.world_from_index(glm::dvec3(origin + voxel_in_brick(n))));
      sampler.sample(points, out);
      for (std::size_t n = 0; n < kBrickVoxels; ++n) {
        const float* c = &out[n * n_channels];
        // A fine voxel needs at least half of its weight on active voxels; others at the field's border are dropped.
        if (c[0] < 0.5f) continue;
        const std::size_t v = brick * kBrickVoxels + n;
        active[v] = 1;
        fa[v] = c[1] / c[0] - 0.6931472f;  // half the depth in half the length
        for (std::size_t m = 0; m < n_source; ++m) fb[v * n_source + m] = c[2 + m] / c[0];
      }
    }
  });
  std::vector<float> log_depth, coefficients;
  for (std::size_t v = 0; v < n_voxels; ++v) {
    if (active[v] == 0) continue;
    log_depth.push_back(fa[v]);
    coefficients.insert(coefficients.end(), &fb[v * n_source], &fb[v * n_source] + n_source);
  }
  fine.set_voxels(std::move(topology), active, torch::tensor(log_depth),
                  torch::tensor(coefficients).view({-1, static_cast<std::int64_t>(n_source)}));
  return fine;
}

namespace {

/// State of the forward pass that the backward pass needs. Borrows its memory from the field's idle memory.
struct Pass : torch::CustomClassHolder {
  Pass(const GridField& grid, const RaySampling& sampling) : field(&grid), idle(grid.idle_memory()) {
    if (!idle->empty()) {
      memory = std::move(idle->back());
      idle->pop_back();
    }
    grid.values(memory.values);
    renderer.emplace(grid.view(memory.values), grid.channels(), grid.occupancy(), sampling, memory.rows, grid.ground.get());
    memory.rows = renderer->memory();
  }
  ~Pass() override { idle->push_back(std::move(memory)); }
  Pass(const Pass&) = delete;
  Pass& operator=(const Pass&) = delete;

  const GridField* field;
  std::shared_ptr<std::vector<GridField::Memory>> idle;
  GridField::Memory memory;
  std::optional<RowRenderer> renderer;
};

/// RowRenderer as an autograd function of LibTorch.
struct RenderRows : torch::autograd::Function<RenderRows> {
  static torch::autograd::variable_list forward(torch::autograd::AutogradContext* context, const torch::Tensor& log_depth,
                                                const torch::Tensor& coefficients, const c10::intrusive_ptr<Pass>& pass,
                                                std::span<const RowRequest> rows) {
    context->saved_data["pass"] = torch::IValue::make_capsule(pass);
    context->save_for_backward({log_depth, coefficients});
    torch::Tensor pixels = torch::empty({static_cast<std::int64_t>(n_pixels(rows))}, torch::kFloat);
    pass->renderer->forward(rows, numbers(pixels));
    return {pixels};
  }

  static torch::autograd::variable_list backward(torch::autograd::AutogradContext* context,
                                                 torch::autograd::variable_list gradients) {
    const auto pass = c10::static_intrusive_pointer_cast<Pass>(context->saved_data["pass"].toCapsule());
    const auto saved = context->get_saved_variables();
    const torch::Tensor d_pixels = gradients[0].contiguous();
    const GridField& field = *pass->field;
    std::vector<float>& d_active = pass->memory.d_active;
    d_active.resize(field.n_active() * static_cast<std::size_t>(field.channels().count()));
    pass->renderer->backward(numbers(d_pixels), field.active_voxels(), d_active);

    torch::Tensor d_depth = torch::empty_like(saved[0]), d_coefficients = torch::empty_like(saved[1]);
    field.parameter_gradients(d_active, d_depth.data_ptr<float>(), d_coefficients.data_ptr<float>());
    return {d_depth, d_coefficients, {}, {}};
  }
};

}  // namespace

torch::Tensor GridField::render_rows(std::span<const RowRequest> rows, const RaySampling& sampling) const {
  return RenderRows::apply(log_depth, coefficients, c10::make_intrusive<Pass>(*this, sampling), rows).front();
}

void GridField::render_rows(std::span<const RowRequest> rows, const RaySampling& sampling,
                            std::span<float> pixels) const {
  Pass(*this, sampling).renderer->forward(rows, pixels);
}

}  // namespace sarnerf

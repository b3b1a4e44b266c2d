// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/nerf/mlp_field.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <numbers>
#include <string>
#include <vector>

#include <torch/csrc/autograd/custom_function.h>

#include "field/rows.h"
#include "field/tensors.h"
#include "sarnerf/core/error.h"
#include "sarnerf/nerf/row_renderer.h"

namespace sarnerf {

namespace {

/// Period of the encoding's finest wave, in range bins. Twice as many frequencies learn half as fast, and fit details that
/// the images do not determine: 38.9 dB instead of 41.9 after half a minute with the authors' 10 frequencies.
constexpr double kFinestPeriod_bins = 1.5;

/// The cube around the scene's box: the encoding's waves are equally long along all axes.
Box cube_around(const Box& box_m) {
  const glm::dvec3 size = box_m.size(), centre = box_m.centre();
  const glm::dvec3 half(0.5 * std::max({size.x, size.y, size.z}));
  return {centre - half, centre + half};
}

/// All voxels of a scene's box.
CarvedVoxels voxels_of_box(const Box& box_m, const GridTransform& transform) {
  const glm::ivec3 first = glm::ivec3(glm::floor(transform.index_from_world(box_m.min)));
  const glm::ivec3 last = glm::ivec3(glm::ceil(transform.index_from_world(box_m.max)));
  CarvedVoxels all;
  for (int x = first.x; x <= last.x; ++x)
    for (int y = first.y; y <= last.y; ++y)
      for (int z = first.z; z <= last.z; ++z) all.add({x, y, z});
  return all;
}

void check(const MlpOptions& o) {
  const auto require = [](bool holds, const char* what, double found) {
    if (!holds)
      throw UsageError(std::string("field mlp: ") + what + ", found " + std::to_string(found));
  };
  require(o.voxel_size_m > 0.0, "voxel_size_m must be above 0", o.voxel_size_m);
  require(o.rate > 0.0, "rate must be above 0", o.rate);
  require(o.warm_up_steps > 0, "warm_up_steps must be above 0", o.warm_up_steps);
  require(o.initial_depth > 0.0, "initial_depth must be above 0, or nothing can grow",
          o.initial_depth);
  require(o.refresh_steps > 0, "refresh_steps must be above 0", o.refresh_steps);
}

}  // namespace

MlpField::MlpField(MlpNetwork network, const MlpUnits& units, const GridTransform& transform,
                   CarvedVoxels voxels)
    : network_(std::move(network)),
      units_(units),
      cache_(transform, std::move(voxels)),
      kernel_(network_.parameters.scalar_type() == torch::kFloat ? best_mlp_kernel(network_.shape)
                                                                 : MlpKernel::plain) {}

MlpField::Values MlpField::evaluate(std::span<const glm::vec3> point_m,
                                    std::span<const glm::vec3> ray_direction,
                                    std::span<const std::uint32_t> ray_begin) const {
  const MlpOutput out = mlp_forward(network_, point_m, ray_direction, ray_begin, kernel_);
  return {out.sigma_raw.relu() * (0.5 / units_.reference_bin_m),
          (units_.literal ? out.s_raw : torch::softplus(out.s_raw)) * units_.source_scale};
}

void MlpField::refresh(double least_depth) {
  const torch::NoGradGuard no_grad;
  const std::vector<glm::vec3> points = cache_.points_m();
  const glm::vec3 direction(0.0f, -1.0f, 0.0f);  // κ does not depend on it
  const std::uint32_t ray_begin[] = {0, static_cast<std::uint32_t>(points.size())};
  const torch::Tensor kappa = evaluate(points, {&direction, 1}, ray_begin).extinction_per_m.to(torch::kFloat).contiguous();
  cache_.refresh({kappa.data_ptr<float>(), points.size()}, least_depth);
}

void MlpField::restore_cache(std::span<const float> extinction_per_m, double least_depth) {
  cache_.refresh(extinction_per_m, least_depth);
}

std::string MlpField::size_text() const {
  char text[96];
  std::snprintf(text, sizeof text, "%lld weights, %zu voxels of %.3g m",
                static_cast<long long>(network_.parameters.numel()), cache_.n_occupied(),
                voxel_size_m());
  return text;
}

int suitable_frequencies(const Box& scene_box_m, double bin_m) {
  constexpr int kMost = 10;  // of the authors' code
  const double side_m = cube_around(scene_box_m).size().x;
  // Frequency number l has 2^l periods in the cube.
  const double finest = std::floor(std::log2(side_m / (kFinestPeriod_bins * bin_m)));
  return static_cast<int>(std::clamp(finest + 1.0, 1.0, double{kMost}));
}

namespace {

/// Rows that are rendered at a time without gradients: bounds the memory.
constexpr std::size_t kRowsAtATime = 8;

/// The rows as the paper samples them.
std::vector<RowRequest> on_fixed_lattice(std::span<const RowRequest> rows, const Box& box_m) {
  std::vector<RowRequest> fixed(rows.begin(), rows.end());
  for (RowRequest& row : fixed) row.even = make_fan(angular_extent(row.acquisition, box_m), row.acquisition.n_range);
  return fixed;
}

/// State of the forward pass that the backward pass needs.
struct Pass : torch::CustomClassHolder {
  Pass(std::span<const RowRequest> rows, const RaySampling& sampling, const MlpField& field)
      : segments(rows, sampling, field.cache(), field.ground), integrator(field.units().integrator) {}

  RowSegments segments;
  Integrator integrator;
};

/// RowSegments as an autograd function of LibTorch.
struct IntegrateRows : torch::autograd::Function<IntegrateRows> {
  static torch::autograd::variable_list forward(torch::autograd::AutogradContext* context,
                                                const torch::Tensor& extinction_per_m, const torch::Tensor& brightness,
                                                const c10::intrusive_ptr<Pass>& pass) {
    context->saved_data["pass"] = torch::IValue::make_capsule(pass);
    torch::Tensor pixels =
        torch::empty({static_cast<std::int64_t>(pass->segments.n_pixels())}, torch::kFloat);
    pass->segments.integrate(numbers(extinction_per_m.contiguous()),
                             numbers(brightness.contiguous()), pass->integrator, numbers(pixels));
    return {pixels};
  }

  static torch::autograd::variable_list backward(torch::autograd::AutogradContext* context,
                                                 torch::autograd::variable_list gradients) {
    const auto pass =
        c10::static_intrusive_pointer_cast<Pass>(context->saved_data["pass"].toCapsule());
    const auto n = static_cast<std::int64_t>(pass->segments.n_segments());
    torch::Tensor d_extinction = torch::empty({n}, torch::kFloat),
                  d_brightness = torch::empty_like(d_extinction);
    pass->segments.adjoint(numbers(gradients[0].contiguous()), pass->integrator, numbers(d_extinction), numbers(d_brightness));
    return {d_extinction, d_brightness, {}};
  }
};

}  // namespace

torch::Tensor MlpField::render_rows(std::span<const RowRequest> rows, const RaySampling& asked) const {
  RaySampling sampling = asked;
  std::vector<RowRequest> fixed;
  if (units_.literal) {
    rows = fixed = on_fixed_lattice(rows, occupied_box_m());
    sampling.sub_rows = 1;
    sampling.deposit = Deposit::in_bin;
    sampling.longest_m = std::numeric_limits<double>::infinity();
    sampling.end_depth = std::numeric_limits<double>::infinity();
  }
  const auto pass = c10::make_intrusive<Pass>(rows, sampling, *this);
  const RowSegments& s = pass->segments;
  const Values values = evaluate(s.point_m(), s.ray_direction(), s.ray_begin());
  return IntegrateRows::apply(values.extinction_per_m.to(torch::kFloat), values.brightness.to(torch::kFloat), pass).front();
}

void MlpField::render_rows(std::span<const RowRequest> rows, const RaySampling& sampling,
                           std::span<float> pixels) const {
  if (pixels.size() != n_pixels(rows))
    throw UsageError("the rows have " + std::to_string(n_pixels(rows)) + " pixels, not " +
                     std::to_string(pixels.size()));
  const torch::NoGradGuard no_grad;
  for (std::size_t first = 0; first < rows.size(); first += kRowsAtATime) {
    const auto some = rows.subspan(first, std::min(kRowsAtATime, rows.size() - first));
    const torch::Tensor image = render_rows(some, sampling);
    std::copy_n(image.data_ptr<float>(), image.numel(), pixels.begin());
    pixels = pixels.subspan(static_cast<std::size_t>(image.numel()));
  }
}

int suitable_direction_frequencies(std::span<const PosedImage> images) {
  constexpr int kMost = 4;  // of the authors' code
  constexpr double kSame_rad = 1e-3;
  const double turn = 2.0 * std::numbers::pi;
  std::vector<double> azimuths;
  double horizontal = 0.0;  // part of the direction
  for (const PosedImage& image : images) {
    azimuths.push_back(image.acquisition.azimuth_rad - turn * std::floor(image.acquisition.azimuth_rad / turn));
    horizontal = std::max(horizontal, std::sin(image.acquisition.incidence_rad));
  }
  std::sort(azimuths.begin(), azimuths.end());
  azimuths.erase(std::unique(azimuths.begin(), azimuths.end(), [](double a, double b) { return b - a < kSame_rad; }), azimuths.end());
  const std::size_t n = azimuths.size();
  std::vector<double> gaps;
  for (std::size_t k = 0; k < n; ++k) {
    const double next = azimuths[(k + 1) % n] + (k + 1 == n ? turn : 0.0), previous = azimuths[(k + n - 1) % n] - (k == 0 ? turn : 0.0);
    gaps.push_back(std::min(std::max(next - azimuths[k], azimuths[k] - previous), std::numbers::pi));
  }
  if (gaps.empty()) return kMost;
  std::nth_element(gaps.begin(), gaps.begin() + static_cast<std::ptrdiff_t>(n / 2), gaps.end());
  const double spacing = 2.0 * horizontal * std::sin(0.5 * gaps[n / 2]);
  return static_cast<int>(std::clamp(std::floor(-std::log2(spacing)), 0.0, double{kMost}));
}

namespace {

/// Rows of the images that the fog's brightness is fitted to, and the least one, so that S can grow.
constexpr std::size_t kRowsOfFit = 64;
constexpr double kLeastBrightness = 1e-3;

/// Gives the fog the brightness at which its images are nearest to the training images, by least squares: images are linear in S.
/// Fog that is too bright has a gradient to less extinction everywhere, which Adam follows until the ReLU is 0 everywhere.
void fit_brightness(MlpField& field, const MlpLayer& head, const TrainingSet& set) {
  const auto set_brightness = [&](double s) {
    field.network().bias(head).fill_(field.units().literal ? s : std::log(std::expm1(s)));
  };
  std::vector<RowRequest> rows;
  std::vector<float> truth;
  const std::vector<PosedImage>& images = set.training_images();
  for (std::size_t n = 0; n < kRowsOfFit; ++n) {
    const PosedImage& image = images[n * images.size() / kRowsOfFit];
    const int row = static_cast<int>(std::fmod(static_cast<double>(n) * std::numbers::phi, 1.0) * image.power.n_azimuth());
    rows.push_back({image.acquisition, row});
    for (int j = 0; j < image.power.n_range(); ++j) truth.push_back(image.power(row, j));
  }
  RaySampling sampling;
  sampling.ray_spacing_m = sampling.longest_m = field.voxel_size_m();
  std::vector<float> dark(truth.size()), bright(truth.size());
  set_brightness(1e-6);
  field.render_rows(rows, sampling, dark);
  set_brightness(1.0);
  field.render_rows(rows, sampling, bright);
  double product = 0.0, square = 0.0;
  for (std::size_t n = 0; n < truth.size(); ++n) {
    const double by_fog = double{bright[n]} - double{dark[n]};
    product += by_fog * (double{truth[n]} - double{dark[n]});
    square += by_fog * by_fog;
  }
  if (square > 0.0) set_brightness(std::max(product / square, kLeastBrightness));
}

}  // namespace

MlpField initial_mlp_field(const TrainingSet& set, const MlpOptions& options, std::uint64_t seed, const Monitor& monitor) {
  check(options);
  const GridTransform transform = grid_transform(set, options.voxel_size_m);
  CarvedVoxels carved = options.literal ? voxels_of_box(set.box_m, transform) : carve(set, transform, monitor);
  const MlpUnits units{set.finest_bin_m(), double{set.bright}, integrator_from_name(options.integrator), options.literal};
  MlpNetwork network = make_mlp_network(options.shape, cube_around(set.box_m), seed);
  // A ReLU that is 0 everywhere would stay so. Space therefore begins as fog, with variations by the random weights.
  const std::vector<MlpLayer> layers = mlp_layers(options.shape);
  for (const MlpLayer& layer : layers)
    if (layer.name == "sigma") network.bias(layer).fill_(options.initial_depth);
  if (options.literal) clear_identity(options.shape, network.parameters);
  MlpField field(std::move(network), units, transform, std::move(carved));
  if (!options.literal) field.refresh(-1.0);
  if (set.ground) field.ground = set.ground->plane;
  fit_brightness(field, layers.back(), set);
  field.resolution = set.resolution;
  return field;
}

}  // namespace sarnerf

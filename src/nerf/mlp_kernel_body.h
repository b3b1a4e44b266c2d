// SPDX-License-Identifier: Apache-2.0
// The kernels of the network, included once for each instruction set behind its tile products, with
// SARNERF_KERNEL_NAMESPACE its name.
#include "mlp_kernel_backward.h"
#include "mlp_kernel_pack.h"

namespace sarnerf::SARNERF_KERNEL_NAMESPACE {
namespace {

/// Hands out aligned parts of the scratch space.
struct Scratch {
  char* next;
  char* take(std::size_t bytes) {
    char* p = next;
    next += (bytes + 63) / 64 * 64;
    return p;
  }
};

inline std::size_t smaller(std::size_t a, std::size_t b) { return a < b ? a : b; }

/// The same for the samples from `begin` on.
MlpBlockValues advanced(const MlpPlan& plan, const MlpBlockValues& v, std::size_t begin) {
  const std::size_t panel = begin / kPanel;
  MlpBlockValues out{};
  out.position = v.position + panel * panel_bytes(plan.position_steps);
  out.direction = v.direction + panel * panel_bytes(plan.direction_steps);
  for (std::size_t l = 0; l < plan.n_layers; ++l) {
    out.activations[l] = v.activations[l] + panel * panel_bytes(plan.layers[l].n_out / 32);
  }
  return out;
}

}  // namespace

void pack(const MlpPlan& plan, const float* parameters, std::size_t begin, std::size_t end, char* packed) {
  for (std::size_t l = begin; l < end; ++l) pack_layer(plan.layers[l], parameters, packed);
}

void forward(const MlpPlan& plan, const float* parameters, const char* packed, const MlpSamples& samples,
             char* scratch, float* sigma, float* s) {
  const TileSession session;
  Scratch space{scratch};
  constexpr std::size_t kPanels = kMlpBlock / kPanel;
  MlpBlockValues values{};
  values.position = space.take(kPanels * panel_bytes(plan.position_steps));
  values.direction = space.take(kPanels * panel_bytes(plan.direction_steps));
  // A layer reads none but the one before.
  char* turns[2];
  for (char*& turn : turns) turn = space.take(kPanels * panel_bytes(plan.width_steps));
  for (std::size_t l = 0; l < plan.n_layers; ++l) values.activations[l] = turns[l % 2];
  for (std::size_t begin = 0; begin < samples.n; begin += kMlpBlock) {
    forward_block(plan, parameters, packed, samples, begin, smaller(kMlpBlock, samples.n - begin), values,
                  sigma + begin, s + begin);
  }
}

void backward(const MlpPlan& plan, const float* parameters, const char* packed, const MlpSamples& samples,
              const float* sigma_gradient, const float* s_gradient, char* scratch, float* sums) {
  const TileSession session;
  Scratch space{scratch};
  constexpr std::size_t kPanels = kMlpChunk / kPanel, kRuns = kMlpChunk / kMlpRun;
  MlpBlockValues values{};
  values.position = space.take(kPanels * panel_bytes(plan.position_steps));
  values.direction = space.take(kPanels * panel_bytes(plan.direction_steps));
  for (std::size_t l = 0; l < plan.n_layers; ++l) {
    values.activations[l] = space.take(kPanels * panel_bytes(plan.layers[l].n_out / 32));
  }
  const std::size_t run_bytes = kMlpRun / kPanel * panel_bytes(plan.width_steps);
  MlpRunGradient gradients[kRuns + 1];
  for (MlpRunGradient& g : gradients) g = {space.take(run_bytes), space.take(run_bytes)};
  char* transposed = space.take(2 * kTileBytes * (kMlpRun / kPanel));
  auto* outputs = reinterpret_cast<float*>(space.take(2 * kMlpBlock * sizeof(float)));

  for (std::size_t begin = 0; begin < samples.n; begin += kMlpBlock) {
    forward_block(plan, parameters, packed, samples, begin, smaller(kMlpBlock, samples.n - begin),
                  advanced(plan, values, begin), outputs, outputs + kMlpBlock);
  }

  // Layer by layer, so that its weights and their sums are fetched once a chunk. The gradient before a layer takes
  // the place that the run before has left.
  const std::size_t n_runs = (samples.n + kMlpRun - 1) / kMlpRun;
  std::size_t first = 0;
  const std::size_t last = plan.n_layers - 1;
  for (std::size_t run = 0; run < n_runs; ++run) {
    const std::size_t begin = run * kMlpRun, n = smaller(kMlpRun, samples.n - begin);
    const MlpBlockValues v = advanced(plan, values, begin);
    const std::size_t s_steps = plan.layers[last].n_out / 32;
    backward_layer<false, true, true>(plan, last + 1, parameters, packed, v.activations[last], plan.s,
                                      s_gradient + begin, n, {}, gradients[run], sums);
    add_head_gradient(v.activations[last], s_steps, s_gradient + begin, n, sums + plan.s.sum);
    add_head_gradient(v.activations[plan.sigma.layer], plan.layers[plan.sigma.layer].n_out / 32,
                      sigma_gradient + begin, n, sums + plan.sigma.sum);
  }
  for (std::size_t l = last + 1; l-- > 0;) {
    const MlpKernelLayer& layer = plan.layers[l];
    const std::size_t free = (first + kRuns) % (kRuns + 1);
    for (std::size_t run = 0; run < n_runs; ++run) {
      const std::size_t begin = run * kMlpRun, n = smaller(kMlpRun, samples.n - begin);
      const MlpBlockValues v = advanced(plan, values, begin);
      const MlpRunGradient& behind = gradients[(first + run) % (kRuns + 1)];
      const MlpRunGradient& before = gradients[(free + run) % (kRuns + 1)];
      for (std::size_t part = 0; part < 2; ++part) {
        if (layer.steps[part] == 0) continue;
        add_weight_gradient(layer, part, input_values(v, layer.input[part], l), n, behind.paired, transposed,
                            sums);
      }
      if (l == 0) continue;
      const auto through = [&](auto layer_before) {
        layer_before(plan, l, parameters, packed, v.activations[l - 1], plan.sigma, sigma_gradient + begin, n,
                     behind, before, sums);
      };
      if (l - 1 == plan.sigma.layer) {
        through(backward_layer<true, true, true>);
      } else if (l - 1 == plan.sigma.layer + 1) {
        through(backward_layer<true, false, false>);
      } else {
        through(backward_layer<true, true, false>);
      }
    }
    first = free;
  }
}

}  // namespace sarnerf::SARNERF_KERNEL_NAMESPACE

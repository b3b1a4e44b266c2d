// SPDX-License-Identifier: Apache-2.0
// The network's kernels. CMake compiles this file with the compiler's options for AMX. Tests compile it once more, with products of
// tiles that need no AMX (SARNERF_MLP_TILES); the set's name is SARNERF_KERNEL_NAMESPACE.
#ifdef SARNERF_MLP_TILES
#include SARNERF_MLP_TILES
#else
#include "mlp/kernel/mlp_tiles_amx.h"
#endif

#include "mlp/kernel/mlp_kernel_forward.h"

/// The backward pass of a run of samples, layer by layer. Internal linkage: see mlp_kernel.h.
namespace sarnerf {
namespace {

constexpr std::size_t kStep = 32;  ///< samples of a step of the products for the gradient of weights

/// ∂L/∂(a layer's output before its ReLU) of a run of samples, in the two layouts that the products need.
struct MlpRunGradient {
  char* values;
  char* paired;
};

inline __mmask32 positive(__m512i row) {
  return _mm512_cmpgt_epi16_mask(row, _mm512_setzero_si512());
}

/// Adds the pairs of samples of a row of `paired` to `sum`.
inline __m512 add_pairs(__m512 sum, __m512i row) {
  const auto ones = reinterpret_cast<__m512bh>(_mm512_set1_epi16(0x3f80));
  return _mm512_dpbf16_ps(sum, reinterpret_cast<__m512bh>(row), ones);
}

/// Completes a product of 32 samples × 32 features of the layer before, or starts from 0 without a product: adds the gradient
/// by the head that reads that layer, multiplies by the derivative of its ReLU, writes both layouts, adds to its bias's sums.
/// In sixteen parts: see ForwardFinish.
template <bool kProduct, bool kRelu, bool kHead>
struct BackwardFinish {
  const float* c;         ///< [2][2] tiles
  const char* output[2];  ///< tiles of `values` of that layer, of two panels
  __m512 head[2];         ///< weights of 32 features
  const float* gradient;  ///< of the head [32 samples]
  char* values[2];
  char* paired;     ///< two tiles
  float* bias_sum;  ///< [2][16]
  __m512 bias[2];   ///< the same, while it is being summed
  std::size_t part = 16, parts_per_step = 1;

  void operator()() { advance(parts_per_step); }
  void finish() {
    if (!bias_sum) return;
    advance(16);
    _mm512_store_ps(bias_sum, bias[0]);
    _mm512_store_ps(bias_sum + 16, bias[1]);
  }

 private:
  __m512i row_of_panel(std::size_t panel) const {
    __m512 first = _mm512_setzero_ps(), second = first;
    if constexpr (kProduct) {
      first = _mm512_load_ps(c + 2 * kTileFloats * panel + 16 * part);
      second = _mm512_load_ps(c + 2 * kTileFloats * panel + kTileFloats + 16 * part);
    }
    if constexpr (kHead) {
      const __m512 g = _mm512_set1_ps(gradient[kPanel * panel + part]);
      first = _mm512_fmadd_ps(g, head[0], first);
      second = _mm512_fmadd_ps(g, head[1], second);
    }
    const __m512i row = to_bf16(first, second);
    if constexpr (!kRelu) return row;
    return _mm512_maskz_mov_epi16(positive(load(output[panel] + 64 * part)), row);
  }

  void advance(std::size_t n) {
    for (; n > 0 && part < 16; --n, ++part) {
      const __m512i a = row_of_panel(0), b = row_of_panel(1);
      store(values[0] + 64 * part, a);
      store(values[1] + 64 * part, b);
      const __m512i even = even_pairs(a, b), odd = odd_pairs(a, b);
      store(paired + 64 * part, even);
      store(paired + kTileBytes + 64 * part, odd);
      bias[0] = add_pairs(bias[0], even);
      bias[1] = add_pairs(bias[1], odd);
    }
  }
};

/// Gradient before layer l of a run of n samples, from the gradient behind it; for l = n_layers, from that of S_r
/// alone.
template <bool kProduct, bool kRelu, bool kHead>
[[gnu::noinline]] void backward_layer(const MlpPlan& plan, std::size_t l, const float* parameters,
                                      const char* packed, const char* output, const MlpKernelHead& head,
                                      const float* head_gradient, std::size_t n, const MlpRunGradient& behind,
                                      const MlpRunGradient& before, float* sums) {
  const MlpKernelLayer& previous = plan.layers[l - 1];
  const std::size_t pairs = previous.n_out / 32;
  const std::size_t steps[2] = {kProduct ? plan.layers[l].n_out / 32 : 1, 0};
  alignas(64) float c[2][4 * kTileFloats];
  BackwardFinish<kProduct, kRelu, kHead> finish{};
  finish.parts_per_step = (16 + steps[0] - 1) / steps[0];
  std::size_t turn = 0;
  for (std::size_t panel = 0; panel < n / kPanel; panel += 2) {
    const TileRun to = panel_pair(before.values, panel, pairs), from = panel_pair(output, panel, pairs);
    for (std::size_t pair = 0; pair < pairs; ++pair) {
      if constexpr (kProduct) {
        const TileRun inputs[2] = {panel_pair(behind.values, panel, steps[0]), {}};
        product(inputs, packed + kTileBytes * (plan.layers[l].packed_previous + 2 * steps[0] * pair), steps,
                c[turn], finish);
      }
      finish.finish();
      finish.c = c[turn];
      for (std::size_t q = 0; q < 2; ++q) {
        finish.values[q] = const_cast<char*>(to.tile[q]) + kTileBytes * pair;
        if constexpr (kRelu) finish.output[q] = from.tile[q] + kTileBytes * pair;
        if constexpr (kHead) finish.head[q] = _mm512_loadu_ps(parameters + head.weight + 32 * pair + 16 * q);
      }
      if constexpr (kHead) finish.gradient = head_gradient + kPanel * panel;
      finish.paired = before.paired + kTileBytes * (pair * (n / kPanel) + panel);
      finish.bias_sum = sums + previous.bias_sum + 32 * pair;
      finish.bias[0] = _mm512_load_ps(finish.bias_sum);
      finish.bias[1] = _mm512_load_ps(finish.bias_sum + 16);
      finish.part = 0;
      turn ^= 1;
    }
  }
  finish.finish();
}

/// Converts 32 features of a run of samples to `transposed`, a tile at a time.
struct TransposeRun {
  const char* values;   ///< first tile of the features
  std::size_t stride;   ///< from panel to panel
  std::size_t n_tiles;  ///< of the result
  char* transposed;
  std::size_t tile = 0, calls_per_tile = 1, calls = 0;

  void operator()() {
    if (++calls < calls_per_tile) return;
    calls = 0;
    advance();
  }
  void finish() {
    while (tile < n_tiles) advance();
  }

 private:
  void advance() {
    if (tile == n_tiles) return;
    const char* first = values + (tile & ~std::size_t{1}) * stride;
    if (tile % 2 == 0) {
      transpose_tile<false>(first, first + stride, transposed + kTileBytes * tile);
    } else {
      transpose_tile<true>(first, first + stride, transposed + kTileBytes * tile);
    }
    ++tile;
  }
};

/// Adds the gradient of a part of a layer's weights from a run of n samples. While 32 of its inputs are multiplied, the
/// next 32 are transposed to the other half of `transposed`.
[[gnu::noinline]] void add_weight_gradient(const MlpKernelLayer& layer, std::size_t part, const char* input,
                                           std::size_t n, const char* paired, char* transposed, float* sums) {
  const std::size_t steps = layer.steps[part], runs = n / kStep, pairs = layer.n_out / 32;
  const std::size_t first_step = part == 0 ? 0 : layer.steps[0];
  const std::size_t half = 2 * kTileBytes * runs;
  TransposeRun next{input, panel_bytes(steps), 2 * runs, transposed};
  next.finish();
  for (std::size_t in = 0; in < steps; ++in) {
    const char* left = next.transposed;
    next = {input + kTileBytes * (in + 1), panel_bytes(steps), in + 1 < steps ? 2 * runs : 0,
            transposed + half * ((in + 1) % 2)};
    next.calls_per_tile = pairs / 2;
    for (std::size_t out = 0; out < pairs; ++out) {
      float* sum = sums + layer.sum + 4 * kTileFloats * ((first_step + in) * pairs + out);
      // The hardware does not predict which sums are next.
      const char* next_sum = reinterpret_cast<const char*>(sum + 4 * kTileFloats);
      add_product(left, paired + 2 * kTileBytes * runs * out, runs, sum, [&] {
        for (std::size_t line = 0; line < 8; ++line) _mm_prefetch(next_sum + 64 * line, _MM_HINT_T0);
        next_sum += 8 * 64;
        next();
      });
    }
    next.finish();
  }
}

/// Adds the gradients of a head's weights and bias from n samples to the sums.
[[gnu::noinline]] void add_head_gradient(const char* values, std::size_t steps, const float* gradient,
                                         std::size_t n, float* sums) {
  for (std::size_t pair = 0; pair < steps; ++pair) {
    __m512 even = _mm512_load_ps(sums + 32 * pair), odd = _mm512_load_ps(sums + 32 * pair + 16);
    for (std::size_t s = 0; s < n; ++s) {
      const __m512i row = load(values + s / kPanel * panel_bytes(steps) + kTileBytes * pair + 64 * (s % kPanel));
      const __m512 g = _mm512_set1_ps(gradient[s]);
      even = _mm512_fmadd_ps(g, even_features(row), even);
      odd = _mm512_fmadd_ps(g, odd_features(row), odd);
    }
    _mm512_store_ps(sums + 32 * pair, even);
    _mm512_store_ps(sums + 32 * pair + 16, odd);
  }
  float* bias = sums + 32 * steps;
  __m512 sum = _mm512_load_ps(bias);
  for (std::size_t s = 0; s < n; s += 16) sum = _mm512_add_ps(sum, _mm512_loadu_ps(gradient + s));
  _mm512_store_ps(bias, sum);
}

}  // namespace
}  // namespace sarnerf

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

/// `v` for the samples from `begin` on.
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
  // A layer reads only the one before.
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

  // Layer by layer, so that its weights and their sums are fetched once a chunk. The gradient before a layer is written
  // to the buffer that the previous run has freed.
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

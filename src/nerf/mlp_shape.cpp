// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/nerf/mlp_shape.h"

#include <string>

#include "sarnerf/core/error.h"

namespace sarnerf {
namespace {

void expect(bool fine, const char* what, int found) {
  if (!fine) throw UsageError(std::string("network: expected ") + what + ", found " + std::to_string(found));
}

}  // namespace

std::vector<MlpLayer> mlp_layers(const MlpShape& shape) {
  expect(shape.depth >= 1, "a depth of at least 1", shape.depth);
  expect(shape.width >= 2 && shape.width % 2 == 0, "an even width of at least 2", shape.width);
  expect(shape.skip < shape.depth - 1 || shape.skip < 0, "a skip before the last layer of the trunk", shape.skip);
  expect(shape.position_frequencies >= 0 && shape.position_frequencies <= 64, "0 to 64 frequencies of the position",
         shape.position_frequencies);
  expect(shape.direction_frequencies >= 0 && shape.direction_frequencies <= 64,
         "0 to 64 frequencies of the direction", shape.direction_frequencies);

  std::vector<MlpLayer> layers;
  std::int64_t next = 0;
  const auto add = [&](std::string_view name, int n_in, int n_out) {
    const std::int64_t n_weights = std::int64_t{n_in} * n_out;
    layers.push_back({name, n_in, n_out, next, next + n_weights});
    next += n_weights + n_out;
  };
  const int position = encoded_size(shape.position_frequencies);
  for (int l = 0; l < shape.depth; ++l) {
    const int before = l == 0 ? 0 : shape.width;
    const bool sees_position = l == 0 || (shape.skip >= 0 && l == shape.skip + 1);
    add("trunk", before + (sees_position ? position : 0), shape.width);
  }
  add("sigma", shape.width, 1);
  add("bottleneck", shape.width, shape.width);
  add("direction", shape.width + encoded_size(shape.direction_frequencies), shape.width / 2);
  add("s", shape.width / 2, 1);
  return layers;
}

std::int64_t mlp_parameter_count(const MlpShape& shape) {
  const MlpLayer last = mlp_layers(shape).back();
  return last.bias + last.n_out;
}

}  // namespace sarnerf

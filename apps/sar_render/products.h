// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "job.h"
#include "layer_files.h"

namespace sarnerf::app {

/// What one rendered view becomes, ready to be written.
struct Products {
  std::vector<std::byte> tiff;  ///< float32, of the calibration and quantity asked for
  std::vector<std::byte> png;   ///< display picture
  std::vector<LayerFile> layers;  ///< those asked for
  std::uint64_t n_hits = 0;
  double trace_and_deposit_s = 0.0;
  double formation_s = 0.0;
  double encode_s = 0.0;
  std::vector<std::string> warnings;
};

/// Renders a view of the job and encodes it. Throws NumericsError when a pixel is not finite.
Products make_products(const Job& job, std::size_t view, const Monitor& monitor);

}  // namespace sarnerf::app

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

#include "sarnerf/scene/vdb_scene.h"

namespace sarnerf {

/// read_vdb() of a file's bytes; `name` is what messages call it.
VdbScene read_vdb_bytes(std::string_view bytes, const std::string& name, const VdbReadOptions& options);

}  // namespace sarnerf

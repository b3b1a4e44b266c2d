// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

#include "sarnerf/core/monitor.h"
#include "sarnerf/dataset/manifest.h"

namespace sarnerf {

/// SHA-256 of a dataset: of its manifest and its images in the manifest's order, in the form
///
///     sha256sum dataset.json IMAGE… | sha256sum
///
/// so that a model can say what it was learned from. Throws InputError for a file that cannot be read, Interrupted when
/// the monitor asks for it. Cost: reading all images, in parallel.
std::string dataset_fingerprint(const std::filesystem::path& folder, const Dataset& dataset,
                                const Monitor& monitor = {});

}  // namespace sarnerf

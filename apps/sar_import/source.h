// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "console.h"
#include "options.h"
#include "sarnerf/core/monitor.h"
#include "sarnerf/dataset/chip.h"

namespace sarnerf::app {

/// An image that could be imported.
struct Source {
  std::filesystem::path file;
  Chip
      chip;  ///< without its pixels; pictures have no size yet, nor a depression (0) where none is known
  std::string split;  ///< of a table; empty: none
};

/// All that the inputs hold, in no order. Phoenix and SAMPLE files are read to the end, so that a bad one costs no work;
/// of pictures the table or the names. Files of other kinds in folders are passed over with a note. Throws InputError
/// for bad ones and where nothing is found.
std::vector<Source> find_sources(const Options& options, Console& console, const Monitor& monitor);

/// Throws UsageError where the largest of the files, decoded on every thread, takes more than there is. Reads headers.
void refuse_beyond_memory(const Options& options, const std::vector<Source>& sources);

/// Reads every image once and notes its size, so that a bad one is known before anything is written. Throws InputError.
void read_sizes(const Options& options, std::vector<Source>& sources, const Monitor& monitor);

/// The source with its pixels, cropped. Throws InputError for a file that is bad by now.
Chip load(const Options& options, const Source& source);

/// The resolution of all chips' impulse responses, where their files say the same.
std::optional<Resolution> common_resolution(std::span<const Source> sources);

}  // namespace sarnerf::app

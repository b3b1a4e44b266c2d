// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "memory_limit.h"
#include "options.h"

namespace sarnerf::app {

struct Job;

// The memory that a job is expected to take, against what it may (memory_limit.h). Each throws UsageError, saying what
// is needed and what would fit, before anything of that size is allocated.

/// What of a limit (0: none) is left for voxels beside the program itself.
std::uint64_t memory_for_volume(std::uint64_t limit_bytes);

/// Before the scene is loaded: images of the size asked for.
void refuse_size_beyond_memory(const Options& options, const MemoryLimit& limit);

/// Before the engine is built: scene, engine and images of the framed size.
void refuse_scene_beyond_memory(const Job& job);

/// After planning: chooses how many views are rendered at once, one per thread when there are enough
/// and memory allows it, and sets Job::memory_bytes. Many small views run best one per thread, a few
/// large ones with all threads on each.
void decide_views_at_once(Job& job);

}  // namespace sarnerf::app

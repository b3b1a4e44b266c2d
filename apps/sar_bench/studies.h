// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "sarnerf/scene/scene.h"

namespace sarnerf::bench {

/// What all studies share.
struct StudyOptions {
  std::vector<std::string> scene_files;  ///< rendered at 45° from 10 km unless said otherwise
  LoadOptions load;
  double pitch_deg = 45.0;
  double azimuth_deg = 20.0;
  double spacing_m = 0.3;
  int size = 128;
  int rounds = 15;
  bool quick = false;
  std::string render_flags;  ///< passed on to sar_render by study_sweep
};

/// Tracing and deposit against bare Embree over the same kept rays, and whole views against bare
/// single-ray tracing of the full ray grid; one entry a scene. One thread.
nlohmann::json study_engine(const StudyOptions& options);

/// Both engines on one thread and on several, voxels of a range bin: one entry a scene.
nlohmann::json study_threads(const StudyOptions& options, int n_threads);

/// Tracing and deposit of a mesh of 12 thousand and one of 1.2 million triangles, same shape and rays.
nlohmann::json study_triangles(const StudyOptions& options);

/// A 1024 × 1024 image of a million triangles: seconds, and the peak memory of the whole process.
nlohmann::json study_large_image(const StudyOptions& options);

/// A sweep of 360 views with TIFF and PNG by the sar_render beside this program: whole process, all
/// threads, one entry a scene file.
nlohmann::json study_sweep(const StudyOptions& options);

/// Integrators, forward and adjoint, for each instruction set of this processor: ns a segment.
nlohmann::json study_integrators(const StudyOptions& options);

/// The voxel engine beside the surface engine: time, error, voxels and memory at one bin to an eighth, slope
/// of the error, the dense march of the same rays, and what doubling the empty space changes. One thread.
nlohmann::json study_voxel(const StudyOptions& options);

/// Machine, compiler, revision, threads: printed with every result.
nlohmann::json environment();

}  // namespace sarnerf::bench

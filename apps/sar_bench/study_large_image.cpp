// SPDX-License-Identifier: Apache-2.0
#include <sys/resource.h>

#include <chrono>

#include "generated.h"
#include "studies.h"
#include "view.h"

namespace sarnerf::bench {

nlohmann::json study_large_image(const StudyOptions& options) {
  const Scene scene = bumpy_sphere(1'000'000, 60.0);
  const SurfaceEngine engine(scene);
  StudyOptions large = options;
  large.size = 1024;
  large.spacing_m = 0.2;
  const ViewPlan plan = engine.plan(standard_view(scene, large), {});
  const auto start = std::chrono::steady_clock::now();
  engine.render(plan);
  const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - start;
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return {{"triangles", scene.mesh.triangles.size()},
          {"size", {1024, 1024}},
          {"kept_rays", plan.n_kept_rays},
          {"build_s", engine.build_s()},
          {"render_s", elapsed.count()},
          {"peak_process_mb", static_cast<double>(usage.ru_maxrss) / 1024.0}};
}

}  // namespace sarnerf::bench

// SPDX-License-Identifier: Apache-2.0
#include <cstdlib>
#include <filesystem>

#include "sarnerf/core/error.h"
#include "sarnerf/core/parallel.h"
#include "programs.h"
#include "studies.h"
#include "timing.h"

namespace sarnerf::bench {
namespace fs = std::filesystem;

nlohmann::json study_sweep(const StudyOptions& options) {
  const fs::path program = program_beside("sar_render");
  // A fresh folder of our own: only what lies in it is ever removed.
  std::string place = (fs::temp_directory_path() / "sar_bench_sweep_XXXXXX").string();
  if (::mkdtemp(place.data()) == nullptr) throw Error("cannot create a folder like " + place);
  const fs::path folder = fs::path(place) / "sweep";
  nlohmann::json results = nlohmann::json::array();
  for (const std::string& file : options.scene_files) {
    const std::string command = quoted(program.string()) + " " + quoted(fs::absolute(file).string()) +
                                " --pitch 45 --azimuth 0:359:1 --size 128x128 --spacing 0.3 -q " +
                                options.render_flags + " -o " + quoted(folder.string()) + " > /dev/null 2>&1";
    const auto sweep = [&] {
      fs::remove_all(folder);
      if (std::system(command.c_str()) != 0) throw Error("this command failed, run it to see why: " + command);
    };
    const auto times = run_in_turn({sweep}, std::min(options.rounds, 7));
    results.push_back({{"scene", fs::path(file).stem().string()},
                       {"views", 360},
                       {"threads", thread_count()},
                       {"seconds", {{"median", times[0].median()},
                                    {"quartiles", {times[0].quantile(0.25), times[0].quantile(0.75)}},
                                    {"runs", times[0].seconds.size()}}}});
  }
  fs::remove_all(place);
  return results;
}

}  // namespace sarnerf::bench

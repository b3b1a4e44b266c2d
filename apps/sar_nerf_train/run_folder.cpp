// SPDX-License-Identifier: Apache-2.0
#include "run_folder.h"

#include <algorithm>
#include <vector>

#include "output_files.h"
#include "sarnerf/core/atomic_file.h"

namespace sarnerf::app {

bool RunFolder::occupied() const {
  const auto paths = {model(), checkpoints(), config(), metrics(), report(), page(), pictures()};
  std::error_code ignored;
  return std::any_of(paths.begin(), paths.end(),
                     [&](const auto& path) { return std::filesystem::exists(path, ignored); });
}

void RunFolder::clear_reports() const {
  std::filesystem::remove(report());
  std::filesystem::remove(page());
  remove_files(pictures(), [](const auto& path) {
    return path.extension() == ".png" && path.filename().string().starts_with("view_");
  });
}

void RunFolder::clear() const {
  clear_reports();
  std::filesystem::remove(model());
  std::filesystem::remove(metrics());
  std::filesystem::remove(checkpoint());
  std::filesystem::remove(config());
}

void RunFolder::prepare() const {
  make_folder(checkpoints());
  make_folder(pictures());
  for (const auto& folder : {folder_, checkpoints(), pictures()})
    remove_files(folder, AtomicFiles::is_temporary);
}

}  // namespace sarnerf::app

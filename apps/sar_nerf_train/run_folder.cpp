// SPDX-License-Identifier: Apache-2.0
#include "run_folder.h"

#include <algorithm>
#include <vector>

#include "sarnerf/core/atomic_file.h"

namespace sarnerf::app {
namespace {

template <class Condition>
void remove_if(const std::filesystem::path& folder, const Condition& condition) {
  std::vector<std::filesystem::path> chosen;
  std::error_code code;
  for (const auto& entry : std::filesystem::directory_iterator(folder, code)) {
    if (entry.is_regular_file() && condition(entry.path())) chosen.push_back(entry.path());
  }
  for (const std::filesystem::path& path : chosen) std::filesystem::remove(path);
}

}  // namespace

bool RunFolder::occupied() const {
  const auto paths = {model(), checkpoints(), config(), metrics(), report(), page(), pictures()};
  std::error_code ignored;
  return std::any_of(paths.begin(), paths.end(),
                     [&](const auto& path) { return std::filesystem::exists(path, ignored); });
}

void RunFolder::clear_reports() const {
  std::filesystem::remove(report());
  std::filesystem::remove(page());
  remove_if(pictures(), [](const auto& path) {
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
    remove_if(folder, AtomicFiles::is_temporary);
}

}  // namespace sarnerf::app

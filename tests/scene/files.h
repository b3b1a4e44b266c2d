// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>

#include "sarnerf/core/error.h"
#include "sarnerf/scene/scene.h"

namespace sarnerf::test {

/// A folder of its own for each test case, gone at its end.
class ScratchFolder {
 public:
  ScratchFolder() {
    std::string pattern =
        (std::filesystem::temp_directory_path() / "sarnerf-scene-XXXXXX").string();
    path_ = ::mkdtemp(pattern.data());
  }
  ~ScratchFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;

  std::filesystem::path write(const std::string& name, std::string_view bytes) const {
    const std::filesystem::path file = path_ / name;
    std::ofstream(file, std::ios::binary) << bytes;
    return file;
  }
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

/// Message of the Error thrown by `work`, "" when it throws none of that kind.
template <class Expected, class Work>
std::string message_of(Work work) {
  try {
    work();
  } catch (const Expected& error) {
    return error.what();
  }
  return {};
}

inline bool contains(std::string_view text, std::string_view part) {
  return text.find(part) != std::string_view::npos;
}

/// Whether some line of a report holds the text.
inline bool has_line(const std::vector<std::string>& lines, std::string_view part) {
  for (const std::string& line : lines) {
    if (contains(line, part)) return true;
  }
  return false;
}

/// Scene of one file given as text.
inline Scene load_text(const std::string& name, std::string_view text,
                       const LoadOptions& options = {}) {
  const ScratchFolder folder;
  return load_scene(folder.write(name, text), options);
}

}  // namespace sarnerf::test

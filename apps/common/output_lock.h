// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace sarnerf::app {

/// Keeps a second program from writing the same files while it lives; other files of their folders stay free. An empty
/// file `.NAME.lock` lies beside each of them meanwhile. A killed process leaves it behind, without the lock: the next
/// one takes it over. File systems that cannot lock are trusted.
class OutputLock {
 public:
  /// The folders must exist. Throws UsageError, which names the holder, when another program has one of the files.
  explicit OutputLock(const std::vector<std::filesystem::path>& files);
  ~OutputLock();
  OutputLock(const OutputLock&) = delete;
  OutputLock& operator=(const OutputLock&) = delete;

 private:
  struct Held {
    std::filesystem::path path;
    int fd;
  };
  void take(const std::filesystem::path& file);
  void release();

  std::vector<Held> held_;
};

/// "sar_render (process 4711)": who holds the lock (flock) on an open file or folder; "another program" where the
/// system does not say.
std::string lock_holder(int fd);

}  // namespace sarnerf::app

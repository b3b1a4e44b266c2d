// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

namespace sarnerf::app {

/// Keeps a second program from writing into the same folder while it lives. Leaves no file behind, and
/// ends with the process however that ends. File systems that cannot lock are trusted.
class FolderLock {
 public:
  /// Throws UsageError, which names the holder, when another program has the folder.
  explicit FolderLock(const std::filesystem::path& folder);
  ~FolderLock();
  FolderLock(const FolderLock&) = delete;
  FolderLock& operator=(const FolderLock&) = delete;

 private:
  int fd_;
};

}  // namespace sarnerf::app

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace sarnerf::app {

/// The path without the slash that shells put behind folders.
std::filesystem::path without_slash(const std::filesystem::path& folder);

/// The folder of a dataset: what was named, or where the dataset.json lies that was.
std::filesystem::path dataset_folder(const std::filesystem::path& dataset);

/// Absolute, without links and dots and without a slash at its end: it ends in a name, which "." and ".." do not.
std::filesystem::path full_path(const std::filesystem::path& path);

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

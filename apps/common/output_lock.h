// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace sarnerf::app {

/// The path without the trailing slash that shells append to folders.
std::filesystem::path without_slash(const std::filesystem::path& folder);

/// The folder of a dataset, which is named by this folder or by its dataset.json.
std::filesystem::path dataset_folder(const std::filesystem::path& dataset);

/// The absolute path without links, dots and a trailing slash. It ends in a name, never in "." or "..".
std::filesystem::path full_path(const std::filesystem::path& path);

/// While it exists, no second program writes the same files; other files of their folders stay free. An empty file
/// `.NAME.lock` lies beside each of them meanwhile. A killed process leaves it behind, unlocked, and the next process
/// takes it over. File systems that cannot lock are trusted.
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

/// The program that holds the lock (flock) on an open file or folder: "sar_render (process 4711)", or "another
/// program" if the system does not report it.
std::string lock_holder(int fd);

/// While it exists, no second program writes into the same folder. It leaves no file behind, and ends with the
/// process, even if that is killed. File systems that cannot lock are trusted.
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

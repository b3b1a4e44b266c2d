// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <fstream>
#include <map>
#include <mutex>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace sarnerf::app {

/// The files that a sweep has written, with their SHA-256, in a file that `sha256sum --check` reads. It is how a
/// later run knows which views are whole: machines lose power, disks fill up, people edit. Each line is added
/// when its file is in place.
class Checksums {
 public:
  /// Reads what is there; lines that say nothing (the last one may be cut off) are passed over.
  explicit Checksums(std::filesystem::path list);

  /// Whether the file, by its name relative to the list's folder, has the bytes that it had when it was added.
  bool whole(const std::string& name) const;

  /// Whether the file was added with these bytes, whatever has become of it since.
  bool recorded(const std::string& name, std::string_view bytes) const;
  /// Whether the file was added, and has other bytes now, or is gone.
  bool damaged(const std::string& name) const { return digest_.contains(name) && !whole(name); }

  /// Adds files that are in place: name and bytes. Threads may call it. Throws Error when the list cannot be
  /// written.
  struct File {
    std::string name;
    std::span<const std::byte> bytes;
  };
  void add(const std::vector<File>& files);

  /// Writes the list anew, each file once and in order, so that it does not tell what was made when.
  void finish();

 private:
  std::filesystem::path list_;
  std::map<std::string, std::string> digest_;  ///< by name
  std::mutex mutex_;
  std::ofstream out_;
};

}  // namespace sarnerf::app

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string_view>
#include <vector>

namespace sarnerf {

/// What a file survives once it is in place. Either way nobody ever sees a half-written file while the
/// machine stays up.
enum class Durability {
  process,  ///< the end of this process: for the many small files of a sweep, which can be made again
  power,    ///< a power failure too: waits for the disk (fsync), 1 to 20 ms a file
};

/// Files that appear together or not at all: each is written under a temporary name beside its place,
/// and commit() renames them all in the order of their adding. A full disk, an exception or an
/// interrupt before that leaves every place as it was. Killed in the middle, the process leaves only
/// temporary files, which is_temporary() recognises.
///
/// Errors (thrown as Error) name path, reason and what to do.
class AtomicFiles {
 public:
  explicit AtomicFiles(Durability durability = Durability::power) : durability_(durability) {}
  ~AtomicFiles();
  AtomicFiles(const AtomicFiles&) = delete;
  AtomicFiles& operator=(const AtomicFiles&) = delete;

  /// Writes the bytes beside `path`, whose folder must exist.
  void add(const std::filesystem::path& path, std::span<const std::byte> bytes);
  void add(const std::filesystem::path& path, std::string_view text);

  /// For writers that want a file's name: a temporary beside `path`, empty, to be written by the caller
  /// before commit().
  std::filesystem::path reserve(const std::filesystem::path& path);

  /// Puts all of them in place, over what was there.
  void commit();

  /// Whether a file of this name was left behind by a killed process and may be deleted.
  static bool is_temporary(const std::filesystem::path& path);

 private:
  struct Entry {
    std::filesystem::path temporary;
    std::filesystem::path path;
    bool synchronised = true;
  };
  std::vector<Entry> pending_;
  Durability durability_;
};

/// A single file, replaced atomically.
void write_file_atomically(const std::filesystem::path& path, std::string_view text,
                           Durability durability = Durability::power);

/// Creates a folder and its parents where missing. Throws Error when that is impossible or when
/// something there is not a folder.
void make_folder(const std::filesystem::path& folder);

/// Throws Error unless files can be created in the folder; for asking before long work, not after it.
void require_writable(const std::filesystem::path& folder);

}  // namespace sarnerf

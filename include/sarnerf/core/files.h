// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace sarnerf {

/// Failures that a file survives once it is in place. With either, no reader sees a half-written file while the
/// machine stays up.
enum class Durability {
  process,  ///< the end of this process: for the many small files of a sweep, which can be recomputed
  power,    ///< a power failure too: waits for the disk (fsync), 1 to 20 ms a file
};

/// A set of files that is put in place together. Each is written under a temporary name beside its path, and
/// commit() renames them in the order in which they were added. A full disk, an exception or an interrupt before
/// commit() leaves every path as it was; a process that is killed before it leaves only temporary files, which
/// is_temporary() recognises. A failure within commit() leaves the files that were renamed so far in place.
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

  /// For writers that need a file name: creates an empty temporary file beside `path` and returns its name. The
  /// caller writes it before commit().
  std::filesystem::path reserve(const std::filesystem::path& path);

  /// Renames all files to their paths; existing files are replaced.
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

/// Throws Error unless files can be created in the folder. Call it before long work, not after it.
void require_writable(const std::filesystem::path& folder);

}  // namespace sarnerf

/// Checks of input files before anything opens them. Only regular files pass: reading a pipe could wait for ever,
/// and a device has no end.
namespace sarnerf {

/// Size in bytes. Throws InputError, in one line, for a path that is missing, not a regular file, or not accessible.
std::uint64_t regular_file_size(const std::filesystem::path& path);

/// Calls visit(entry) for everything below a folder; a subfolder for which it returns false is not entered. The order is the file system's.
/// Throws InputError, in one line, for a folder that cannot be read.
void walk_folder(const std::filesystem::path& folder, const std::function<bool(const std::filesystem::directory_entry&)>& visit);

/// The whole content; the file may be empty. Throws InputError as regular_file_size() does, and for a file
/// that cannot be opened or that ends early.
std::string read_whole_file(const std::filesystem::path& path);

}  // namespace sarnerf

namespace sarnerf {

/// SHA-256 (FIPS 180-4), the fingerprint of input files: the figure that `sha256sum` prints.
/// Cost: some 200 MB/s.
class Sha256 {
 public:
  void update(std::span<const std::byte> bytes);

  /// Ends the message; 64 lower-case hexadecimal digits. Call once.
  std::string hex_digest();

 private:
  void compress(const std::byte* block);

  std::array<std::uint32_t, 8> state_{0x6a09e667, 0xbb67ae85, 0x3c6ef372, 0xa54ff53a,
                                      0x510e527f, 0x9b05688c, 0x1f83d9ab, 0x5be0cd19};
  std::array<std::byte, 64> pending_{};
  std::uint64_t n_bytes_ = 0;
};

/// Digest of bytes in memory.
std::string sha256_hex(std::span<const std::byte> bytes);

/// Digest of a file's content. Throws InputError when it cannot be read.
std::string sha256_of_file(const std::filesystem::path& path);

}  // namespace sarnerf

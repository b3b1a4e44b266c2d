// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/core/atomic_file.h"

#include <fcntl.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstring>
#include <string>
#include <system_error>
#include <utility>

#include "sarnerf/core/error.h"

namespace sarnerf {
namespace {

constexpr std::string_view kTemporarySuffix = ".partial";

std::string advice(int code) {
  switch (code) {
    case ENOSPC:
    case EDQUOT:
      return "free some space or write elsewhere";
    case EFBIG:
      return "raise the limit on file sizes (ulimit -f)";
    case EACCES:
    case EPERM:
    case EROFS:
      return "choose a folder that you may write to";
    case ENOENT:
    case ENOTDIR:
      return "check the output path";
    default:
      return "check the output path and its disk";
  }
}

[[noreturn]] void fail(const std::filesystem::path& path, const char* what, int code) {
  throw Error(path.string() + ": " + what + ": " + std::strerror(code) + "; " + advice(code));
}

/// Closes a file descriptor that a thrown error leaves behind.
class Descriptor {
 public:
  explicit Descriptor(int fd) : fd_(fd) {}
  ~Descriptor() {
    if (fd_ >= 0) ::close(fd_);
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  int get() const { return fd_; }
  int release() { return std::exchange(fd_, -1); }

 private:
  int fd_;
};

/// 0 or the reason why not all was written.
int write_all(int fd, std::span<const std::byte> bytes) {
  while (!bytes.empty()) {
    const ssize_t n = ::write(fd, bytes.data(), bytes.size());
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) return errno;
    if (n == 0) return ENOSPC;
    bytes = bytes.subspan(static_cast<std::size_t>(n));
  }
  return 0;
}

std::filesystem::path folder_of(const std::filesystem::path& path) {
  return path.has_parent_path() ? path.parent_path() : std::filesystem::path(".");
}

/// A renamed file is safe from power failures only once its folder is. Some file systems do not let
/// folders be synchronised; there nothing more can be done.
void synchronise_folder(const std::filesystem::path& folder) {
  const Descriptor fd(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (fd.get() >= 0) (void)::fsync(fd.get());
}

std::filesystem::path temporary_name(const std::filesystem::path& path) {
  static std::atomic<unsigned> count{0};
  std::string name = ".";
  name += path.filename().string();
  name.append(1, '.').append(std::to_string(::getpid())).append(1, '-');
  name.append(std::to_string(count++)).append(kTemporarySuffix);
  return folder_of(path) / name;
}

}  // namespace

AtomicFiles::~AtomicFiles() {
  std::error_code ignored;
  for (const Entry& entry : pending_) std::filesystem::remove(entry.temporary, ignored);
}

void AtomicFiles::add(const std::filesystem::path& path, std::span<const std::byte> bytes) {
  const std::filesystem::path temporary = temporary_name(path);
  Descriptor fd(::open(temporary.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666));
  if (fd.get() < 0) fail(path, "cannot be created", errno);
  pending_.push_back({temporary, path});
  if (const int code = write_all(fd.get(), bytes)) fail(path, "cannot be written", code);
  if (durability_ == Durability::power && ::fsync(fd.get()) != 0 && errno != EINVAL) {
    fail(path, "cannot be written", errno);
  }
  // Network file systems report a full disk only here.
  if (::close(fd.release()) != 0) fail(path, "cannot be written", errno);
}

void AtomicFiles::add(const std::filesystem::path& path, std::string_view text) {
  add(path, std::as_bytes(std::span(text)));
}

std::filesystem::path AtomicFiles::reserve(const std::filesystem::path& path) {
  const std::filesystem::path temporary = temporary_name(path);
  const Descriptor fd(::open(temporary.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666));
  if (fd.get() < 0) fail(path, "cannot be created", errno);
  pending_.push_back({temporary, path, false});
  return temporary;
}

void AtomicFiles::commit() {
  for (const Entry& entry : pending_) {
    if (entry.synchronised || durability_ != Durability::power) continue;
    const Descriptor fd(::open(entry.temporary.c_str(), O_RDONLY | O_CLOEXEC));
    if (fd.get() < 0 || (::fsync(fd.get()) != 0 && errno != EINVAL)) {
      fail(entry.path, "cannot be written", errno);
    }
  }
  for (const Entry& entry : pending_) {
    if (::rename(entry.temporary.c_str(), entry.path.c_str()) != 0) {
      fail(entry.path, "cannot be put in place", errno);
    }
  }
  if (durability_ == Durability::power) {
    std::filesystem::path last;
    for (const Entry& entry : pending_) {
      const std::filesystem::path folder = folder_of(entry.path);
      if (folder != last) synchronise_folder(folder);
      last = folder;
    }
  }
  pending_.clear();
}

bool AtomicFiles::is_temporary(const std::filesystem::path& path) {
  const std::string name = path.filename().string();
  return name.starts_with('.') && name.ends_with(kTemporarySuffix);
}

void write_file_atomically(const std::filesystem::path& path, std::string_view text,
                           Durability durability) {
  AtomicFiles files(durability);
  files.add(path, text);
  files.commit();
}

void make_folder(const std::filesystem::path& folder) {
  std::error_code code;
  std::filesystem::create_directories(folder, code);
  if (code) fail(folder, "the folder cannot be created", code.value());
  if (!std::filesystem::is_directory(folder, code)) {
    fail(folder, "the folder cannot be created", ENOTDIR);
  }
}

void require_writable(const std::filesystem::path& folder) {
  const std::filesystem::path probe = temporary_name(folder / "probe");
  const Descriptor fd(::open(probe.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666));
  if (fd.get() < 0) fail(folder, "files cannot be created in this folder", errno);
  ::unlink(probe.c_str());
}

}  // namespace sarnerf

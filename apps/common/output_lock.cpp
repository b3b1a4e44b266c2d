// SPDX-License-Identifier: Apache-2.0
#include "output_lock.h"

#include <cerrno>
#include <cstdio>
#include <fstream>
#include <system_error>

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <sys/sysmacros.h>
#include <unistd.h>

#include "console.h"
#include "sarnerf/core/error.h"

namespace sarnerf::app {

std::filesystem::path without_slash(const std::filesystem::path& folder) {
  return folder.has_filename() ? folder : folder.parent_path();
}

std::filesystem::path dataset_folder(const std::filesystem::path& dataset) {
  if (dataset.filename() != "dataset.json") return without_slash(dataset);
  return dataset.has_parent_path() ? dataset.parent_path() : std::filesystem::path(".");
}

std::filesystem::path full_path(const std::filesystem::path& path) {
  std::error_code ignored;
  const std::filesystem::path full = std::filesystem::weakly_canonical(path, ignored);
  return without_slash(full.empty() ? path : full);  // empty: a folder on the way may not be read
}

namespace {

/// Whether the path still names the open file: its last holder may have removed it meanwhile.
bool is_at(int fd, const std::filesystem::path& path) {
  struct stat opened = {}, named = {};
  return ::fstat(fd, &opened) == 0 && ::stat(path.c_str(), &named) == 0 && opened.st_dev == named.st_dev &&
         opened.st_ino == named.st_ino;
}

std::filesystem::path lock_name(const std::filesystem::path& file) {
  return file.parent_path() / ("." + file.filename().string() + ".lock");
}

}  // namespace

std::string lock_holder(int fd) {
  const std::string unknown = "another program";
  struct stat file = {};
  if (::fstat(fd, &file) != 0) return unknown;
  // "1: FLOCK  ADVISORY  WRITE 4711 fe:00:9977966 0 EOF"
  std::ifstream locks("/proc/locks");
  for (std::string line; std::getline(locks, line);) {
    int process = 0;
    unsigned major_id = 0, minor_id = 0;
    unsigned long long inode = 0;
    if (std::sscanf(line.c_str(), "%*s FLOCK %*s %*s %d %x:%x:%llu", &process, &major_id, &minor_id, &inode) != 4) continue;
    if (process <= 0 || inode != file.st_ino || major_id != major(file.st_dev) || minor_id != minor(file.st_dev)) continue;
    std::string program = unknown;
    std::ifstream name("/proc/" + std::to_string(process) + "/comm");
    std::getline(name, program);
    return visible(program) + " (process " + std::to_string(process) + ")";
  }
  return unknown;
}

OutputLock::OutputLock(const std::vector<std::filesystem::path>& files) {
  try {
    for (const std::filesystem::path& file : files) take(file);
  } catch (...) {
    release();
    throw;
  }
}

OutputLock::~OutputLock() { release(); }

void OutputLock::take(const std::filesystem::path& file) {
  const std::filesystem::path path = lock_name(file);
  for (;;) {
    // If the lock file cannot be created, writing the output will report the error.
    const int fd = ::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
    if (fd < 0) return;
    if (::flock(fd, LOCK_EX | LOCK_NB) == 0) {
      if (is_at(fd, path)) {
        held_.push_back({path, fd});
        return;
      }
      ::close(fd);
      continue;
    }
    const bool taken = errno == EWOULDBLOCK;
    const std::string holder = taken ? lock_holder(fd) : "";
    ::close(fd);
    if (!taken) return;
    throw UsageError(file.string() + ": " + holder +
                     " is writing it; wait for that or choose another name");
  }
}

void OutputLock::release() {
  for (const Held& held : held_) {
    // Removed before the lock is released: a process that has already opened the file finds that it is gone (is_at()).
    ::unlink(held.path.c_str());
    ::close(held.fd);
  }
  held_.clear();
}

FolderLock::FolderLock(const std::filesystem::path& folder)
    : fd_(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC)) {
  if (fd_ < 0 || ::flock(fd_, LOCK_EX | LOCK_NB) == 0 || errno != EWOULDBLOCK) return;
  const std::string holder = lock_holder(fd_);
  ::close(fd_);
  throw UsageError(folder.string() + ": " + holder +
                   " is writing there; wait for that or choose another folder (-o)");
}

FolderLock::~FolderLock() {
  if (fd_ >= 0) ::close(fd_);
}

}  // namespace sarnerf::app

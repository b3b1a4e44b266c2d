// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/core/input_file.h"

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <memory>
#include <system_error>

#include "sarnerf/core/error.h"

namespace sarnerf {
namespace {

const char* kind(std::filesystem::file_type type) {
  switch (type) {
    case std::filesystem::file_type::directory:
      return "a folder";
    case std::filesystem::file_type::fifo:
      return "a pipe; write its content into a file";
    case std::filesystem::file_type::socket:
      return "a socket";
    case std::filesystem::file_type::character:
    case std::filesystem::file_type::block:
      return "a device";
    default:
      return "something else";
  }
}

}  // namespace

std::uint64_t regular_file_size(const std::filesystem::path& path) {
  std::error_code error;
  const std::filesystem::file_status status = std::filesystem::status(path, error);
  if (status.type() == std::filesystem::file_type::not_found) {
    throw InputError(path.string() + ": no such file; check the path");
  }
  if (status.type() == std::filesystem::file_type::none) {
    throw InputError(path.string() + ": cannot be read: " + error.message());
  }
  if (status.type() != std::filesystem::file_type::regular) {
    throw InputError(path.string() + ": expected a file, found " + kind(status.type()));
  }
  const std::uintmax_t size = std::filesystem::file_size(path, error);
  if (error) throw InputError(path.string() + ": cannot be read: " + error.message());
  return size;
}

std::string read_whole_file(const std::filesystem::path& path) {
  std::string bytes(regular_file_size(path), '\0');
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(std::fopen(path.c_str(), "rb"), std::fclose);
  if (!file) throw InputError(path.string() + ": cannot be opened: " + std::strerror(errno));
  const std::size_t n_read = std::fread(bytes.data(), 1, bytes.size(), file.get());
  if (n_read != bytes.size()) {
    throw InputError(path.string() + ": expected " + std::to_string(bytes.size()) +
                     " bytes, could read " + std::to_string(n_read));
  }
  return bytes;
}

}  // namespace sarnerf

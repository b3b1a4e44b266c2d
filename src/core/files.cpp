// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/core/files.h"

#include <algorithm>
#include <atomic>
#include <bit>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <memory>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include <fcntl.h>
#include <unistd.h>

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

/// Returns 0, or the error code if not all was written.
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

/// A renamed file survives a power failure only once its folder is synchronised. Some file systems do not
/// synchronise folders; this is ignored, because nothing more can be done.
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

void walk_folder(const std::filesystem::path& folder, const std::function<bool(const std::filesystem::directory_entry&)>& visit) {
  std::error_code code;
  std::filesystem::recursive_directory_iterator at(folder, code);
  if (code) throw InputError(folder.string() + ": expected a folder that can be read: " + code.message());
  while (at != std::filesystem::recursive_directory_iterator()) {
    if (!visit(*at)) at.disable_recursion_pending();
    const std::filesystem::path last = at->path();
    at.increment(code);
    if (code) throw InputError(last.string() + ": expected a folder that can be read: " + code.message());
  }
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

namespace {

/// First 32 bits of the fractional parts of the cube roots of the first 64 primes.
constexpr std::array<std::uint32_t, 64> kRoundConstants{
    0x428a2f98, 0x71374491, 0xb5c0fbcf, 0xe9b5dba5, 0x3956c25b, 0x59f111f1, 0x923f82a4, 0xab1c5ed5,
    0xd807aa98, 0x12835b01, 0x243185be, 0x550c7dc3, 0x72be5d74, 0x80deb1fe, 0x9bdc06a7, 0xc19bf174,
    0xe49b69c1, 0xefbe4786, 0x0fc19dc6, 0x240ca1cc, 0x2de92c6f, 0x4a7484aa, 0x5cb0a9dc, 0x76f988da,
    0x983e5152, 0xa831c66d, 0xb00327c8, 0xbf597fc7, 0xc6e00bf3, 0xd5a79147, 0x06ca6351, 0x14292967,
    0x27b70a85, 0x2e1b2138, 0x4d2c6dfc, 0x53380d13, 0x650a7354, 0x766a0abb, 0x81c2c92e, 0x92722c85,
    0xa2bfe8a1, 0xa81a664b, 0xc24b8b70, 0xc76c51a3, 0xd192e819, 0xd6990624, 0xf40e3585, 0x106aa070,
    0x19a4c116, 0x1e376c08, 0x2748774c, 0x34b0bcb5, 0x391c0cb3, 0x4ed8aa4a, 0x5b9cca4f, 0x682e6ff3,
    0x748f82ee, 0x78a5636f, 0x84c87814, 0x8cc70208, 0x90befffa, 0xa4506ceb, 0xbef9a3f7, 0xc67178f2};

std::uint32_t big_endian_word(const std::byte* p) {
  return std::uint32_t(p[0]) << 24 | std::uint32_t(p[1]) << 16 | std::uint32_t(p[2]) << 8 |
         std::uint32_t(p[3]);
}

}  // namespace

void Sha256::compress(const std::byte* block) {
  std::array<std::uint32_t, 64> w;
  for (std::size_t t = 0; t < 16; ++t) w[t] = big_endian_word(block + 4 * t);
  for (std::size_t t = 16; t < 64; ++t) {
    const std::uint32_t s0 = std::rotr(w[t - 15], 7) ^ std::rotr(w[t - 15], 18) ^ (w[t - 15] >> 3);
    const std::uint32_t s1 = std::rotr(w[t - 2], 17) ^ std::rotr(w[t - 2], 19) ^ (w[t - 2] >> 10);
    w[t] = w[t - 16] + s0 + w[t - 7] + s1;
  }
  auto [a, b, c, d, e, f, g, h] = state_;
  for (std::size_t t = 0; t < 64; ++t) {
    const std::uint32_t s1 = std::rotr(e, 6) ^ std::rotr(e, 11) ^ std::rotr(e, 25);
    const std::uint32_t t1 = h + s1 + ((e & f) ^ (~e & g)) + kRoundConstants[t] + w[t];
    const std::uint32_t s0 = std::rotr(a, 2) ^ std::rotr(a, 13) ^ std::rotr(a, 22);
    const std::uint32_t t2 = s0 + ((a & b) ^ (a & c) ^ (b & c));
    h = g, g = f, f = e, e = d + t1, d = c, c = b, b = a, a = t1 + t2;
  }
  const std::array<std::uint32_t, 8> added{a, b, c, d, e, f, g, h};
  for (std::size_t n = 0; n < 8; ++n) state_[n] += added[n];
}

void Sha256::update(std::span<const std::byte> bytes) {
  const std::size_t held = n_bytes_ % 64;
  n_bytes_ += bytes.size();
  if (held > 0) {
    const std::size_t taken = std::min(64 - held, bytes.size());
    std::copy_n(bytes.begin(), taken, pending_.begin() + static_cast<std::ptrdiff_t>(held));
    bytes = bytes.subspan(taken);
    if (held + taken < 64) return;
    compress(pending_.data());
  }
  for (; bytes.size() >= 64; bytes = bytes.subspan(64)) compress(bytes.data());
  std::copy(bytes.begin(), bytes.end(), pending_.begin());
}

std::string Sha256::hex_digest() {
  const std::uint64_t n_bits = n_bytes_ * 8;
  std::vector<std::byte> padding(1 + (119 - n_bytes_ % 64) % 64 + 8);
  padding.front() = std::byte{0x80};
  for (std::size_t n = 0; n < 8; ++n) {
    padding[padding.size() - 1 - n] = static_cast<std::byte>(n_bits >> (8 * n));
  }
  update(padding);
  std::string text;
  for (const std::uint32_t word : state_) {
    char digits[9];
    std::snprintf(digits, sizeof digits, "%08x", word);
    text += digits;
  }
  return text;
}

std::string sha256_hex(std::span<const std::byte> bytes) {
  Sha256 hash;
  hash.update(bytes);
  return hash.hex_digest();
}

std::string sha256_of_file(const std::filesystem::path& path) {
  (void)regular_file_size(path);
  const auto fail = [&] {
    throw InputError(path.string() + ": cannot be read: " + std::strerror(errno));
  };
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(std::fopen(path.c_str(), "rb"),
                                                            std::fclose);
  if (!file) fail();
  Sha256 hash;
  std::vector<std::byte> buffer(1 << 18);
  while (const std::size_t n = std::fread(buffer.data(), 1, buffer.size(), file.get())) {
    hash.update(std::span(buffer).first(n));
  }
  if (std::ferror(file.get())) fail();
  return hash.hex_digest();
}

}  // namespace sarnerf

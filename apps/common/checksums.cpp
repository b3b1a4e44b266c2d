// SPDX-License-Identifier: Apache-2.0
#include "checksums.h"

#include <sstream>

#include "sarnerf/core/atomic_file.h"
#include "sarnerf/core/error.h"
#include "sarnerf/core/input_file.h"
#include "sarnerf/core/sha256.h"

namespace sarnerf::app {
namespace {

constexpr std::size_t kDigits = 64;

std::string text_of(const std::map<std::string, std::string>& digest_of) {
  std::string lines;
  for (const auto& [name, digest] : digest_of) lines += digest + "  " + name + "\n";
  return lines;
}

}  // namespace

Checksums::Checksums(std::filesystem::path list) : list_(std::move(list)) {
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(list_, ignored)) return;
  std::istringstream in(read_whole_file(list_));
  for (std::string line; std::getline(in, line);) {
    if (in.eof()) break;  // cut off: its name may be another one's beginning
    // "<64 digits>  <name>"; a later line replaces an earlier one.
    if (line.size() <= kDigits + 2 || line.compare(kDigits, 2, "  ") != 0) continue;
    digest_[line.substr(kDigits + 2)] = line.substr(0, kDigits);
  }
}

bool Checksums::whole(const std::string& name) const {
  const auto known = digest_.find(name);
  if (known == digest_.end()) return false;
  try {
    return sha256_of_file(list_.parent_path() / name) == known->second;
  } catch (const InputError&) {
    return false;
  }
}

bool Checksums::recorded(const std::string& name, std::string_view bytes) const {
  const auto known = digest_.find(name);
  return known != digest_.end() && known->second == sha256_hex(std::as_bytes(std::span(bytes)));
}

void Checksums::add(const std::vector<File>& files) {
  std::map<std::string, std::string> fresh_digest;
  for (const File& file : files) fresh_digest[file.name] = sha256_hex(file.bytes);
  const std::string lines = text_of(fresh_digest);
  const std::scoped_lock lock(mutex_);
  for (auto& [name, digest] : fresh_digest) digest_[name] = std::move(digest);
  if (!out_.is_open()) {
    // A line that was cut off must not swallow the next one.
    std::error_code ignored;
    const bool fresh = !std::filesystem::exists(list_, ignored) || std::filesystem::file_size(list_, ignored) == 0;
    out_.open(list_, std::ios::binary | std::ios::app);
    if (!fresh) out_ << '\n';
  }
  out_ << lines << std::flush;
  if (!out_) throw Error(list_.string() + ": cannot be written; free some space on the disk, then repeat the command");
}

void Checksums::finish() {
  out_.close();
  write_file_atomically(list_, text_of(digest_));
}

}  // namespace sarnerf::app

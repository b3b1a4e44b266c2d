// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string_view>
#include <utility>

#include "sarnerf/core/error.h"

/// One source file per reader defines this entry, which libFuzzer calls in the preset `fuzz` and replay.cpp in
/// every other build. Whatever the bytes: the reader returns something that keeps its promises, or refuses with
/// an InputError, or a UsageError where memory is limited. Anything else ends the process, and is a finding.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

namespace sarnerf::fuzz {

/// What messages call the input.
inline constexpr const char* kName = "input";

inline std::string_view text_of(const std::uint8_t* data, std::size_t size) {
  return {reinterpret_cast<const char*>(data), size};
}

/// Not assert(): builds without assertions check promises too.
inline void require(bool kept, const char* promise) {
  if (kept) return;
  std::fprintf(stderr, "broken promise: %s\n", promise);
  std::abort();
}

/// A message is one line, whatever names and texts of the file it repeats.
inline void require_one_line(std::string_view message) {
  constexpr std::size_t kLongest = 4000;  // lists of forty names occur
  require(!message.empty() && message.size() <= kLongest, "a refusal says something, and not the whole file");
  for (const char c : message) {
    if (static_cast<unsigned char>(c) >= 0x20 && c != 0x7f) continue;
    std::fprintf(stderr, "%.*s\n", static_cast<int>(message.size()), message.data());
    require(false, "a message is one line without control characters");
  }
}

/// Runs a reader and what uses its result; refusals are right answers.
template <class Work>
int read_or_refuse(Work&& work) {
  try {
    std::forward<Work>(work)();
  } catch (const InputError& error) {
    require_one_line(error.what());
  } catch (const UsageError& error) {
    require_one_line(error.what());
  }
  return 0;
}

}  // namespace sarnerf::fuzz

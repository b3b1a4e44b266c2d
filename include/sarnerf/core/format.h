// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace sarnerf {

/// What printf would print, as a string of any length. The compiler checks the arguments against the pattern.
[[gnu::format(printf, 1, 2)]] std::string format(const char* pattern, ...);

/// 1234567 → "1,234,567".
std::string with_thousands(std::uint64_t count);

/// "1 face", "2,000 faces"; an empty plural is the singular with an s.
std::string counted(std::uint64_t count, std::string_view singular, std::string_view plural = {});

}  // namespace sarnerf

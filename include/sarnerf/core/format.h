// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace sarnerf {

/// What printf would print, as a string of any length. The compiler checks the arguments against the pattern.
[[gnu::format(printf, 1, 2)]] std::string format(const char* pattern, ...);

}  // namespace sarnerf

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>
#include <string>

namespace sarnerf {

/// Bytes as text of letters, digits, + and /, four for every three bytes, padded with = (RFC 4648, section 4).
std::string base64(std::span<const std::byte> bytes);

}  // namespace sarnerf

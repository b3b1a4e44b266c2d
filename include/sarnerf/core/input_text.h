// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

/// What texts from files are checked for before any parser sees them.
namespace sarnerf {

/// The text without UTF-8's byte-order mark, which some editors put in front. Throws InputError "where: …"
/// for a text in UTF-16 or UTF-32.
std::string_view without_byte_order_mark(std::string_view text, const std::string& where);

/// Brackets and braces of JSON within one another, at most; our own files need a handful.
inline constexpr int kDeepestJson = 64;

/// Throws InputError "where: …" for JSON nested more deeply: parsers, printers and destructors descend one
/// call a level, and a file of a few kilobytes could exhaust their stack. Cost: one pass over the text.
void require_shallow_json(std::string_view text, const std::string& where);

}  // namespace sarnerf

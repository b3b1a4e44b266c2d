// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

/// What texts from files are checked for before any parser sees them, and how messages repeat them.
namespace sarnerf {

/// The text without UTF-8's byte-order mark, which some editors put in front. Throws InputError "where: …"
/// for a text in UTF-16 or UTF-32.
std::string_view without_byte_order_mark(std::string_view text, const std::string& where);

/// Brackets and braces of JSON within one another, at most; our own files need a handful.
inline constexpr int kDeepestJson = 64;

/// Throws InputError "where: …" for JSON nested more deeply: parsers, printers and destructors descend one
/// call a level, and a file of a few kilobytes could exhaust their stack. Cost: one pass over the text.
void require_shallow_json(std::string_view text, const std::string& where);

/// Whether there are control characters (below U+0020, or U+007F), which no name of a file should have: a zero
/// byte would end it early, a line break tear the messages that repeat it.
bool has_control_characters(std::string_view text);

/// The text as part of a message, which is one line: control characters become '?', and what is longer than
/// `most_bytes` is cut between two characters of UTF-8 and ends in "…".
std::string in_one_line(std::string_view text, std::size_t most_bytes = std::string_view::npos);

/// A name or a value of a file, in quotes: in_one_line() with 60 bytes.
std::string in_quotes(std::string_view text);

}  // namespace sarnerf

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

namespace sarnerf {

/// What printf would print, as a string of any length. The compiler checks the arguments against the pattern.
[[gnu::format(printf, 1, 2)]] std::string format(const char* pattern, ...);

/// 1234567 → "1,234,567".
std::string with_thousands(std::uint64_t count);

/// "1 face", "2,000 faces"; an empty plural is the singular with an s.
std::string counted(std::uint64_t count, std::string_view singular, std::string_view plural = {});

/// The name that needs the fewest edits to become `name`, case ignored, for messages about unknown names;
/// empty when none comes close. O(length² × names); names of more than 64 characters are passed over.
std::string closest_name(std::string_view name, std::span<const std::string> names);

}  // namespace sarnerf

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

/// Wording shared by notes, warnings and errors.
namespace sarnerf {

/// 1500000000 → "1.5 GB"; decimal units, three digits at most.
std::string human_bytes(std::uint64_t bytes);

/// Shortest text that reads back as the same number.
std::string number_text(double value);

/// "asphalt, brick, concrete"; after `limit` names "… (12 more)". Names are kept to one line and 60 bytes.
std::string listed(std::span<const std::string> names, std::size_t limit = 40);

}  // namespace sarnerf

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

namespace sarnerf {

/// The output of printf as a string of any length. The compiler checks the arguments against the pattern.
[[gnu::format(printf, 1, 2)]] std::string format(const char* pattern, ...);

/// 1234567 → "1,234,567".
std::string with_thousands(std::uint64_t count);

/// "1 face", "2,000 faces"; where `plural` is empty, it is the singular with an s.
std::string counted(std::uint64_t count, std::string_view singular, std::string_view plural = {});

/// The name that needs the fewest edits to become `name`, ignoring case, for messages about unknown names;
/// empty when none is close. O(length² × names); names of more than 64 characters are skipped.
std::string closest_name(std::string_view name, std::span<const std::string> names);

}  // namespace sarnerf

/// Checks of texts from files, made before they are parsed, and quotation of such texts in messages.
namespace sarnerf {

/// The text without the UTF-8 byte-order mark, which some editors add. Throws InputError "where: …" for a text
/// in UTF-16 or UTF-32.
std::string_view without_byte_order_mark(std::string_view text, const std::string& where);

/// Largest nesting depth of JSON arrays and objects; our own files need a handful.
inline constexpr int kDeepestJson = 64;

/// Throws InputError "where: …" for JSON nested more deeply than kDeepestJson: parsers, printers and destructors
/// recurse once per level, and a file of a few kilobytes could exhaust their stack. Cost: one pass over the text.
void require_shallow_json(std::string_view text, const std::string& where);

/// Whether the text has control characters (below U+0020, or U+007F). No file name should have them: a zero byte
/// would end it early, and a line break would split the messages that quote it.
bool has_control_characters(std::string_view text);

/// The text as part of a message, which is one line: control characters become '?', and a text longer than
/// `most_bytes` is cut between two UTF-8 characters and ends in "…".
std::string in_one_line(std::string_view text, std::size_t most_bytes = std::string_view::npos);

/// A name or a value from a file, in quotes: in_one_line() with 60 bytes.
std::string in_quotes(std::string_view text);

}  // namespace sarnerf

/// Wording shared by notes, warnings and errors.
namespace sarnerf {

/// 1500000000 → "1.5 GB"; decimal units, three digits at most.
std::string human_bytes(std::uint64_t bytes);

/// Shortest text that is parsed back as the same number.
std::string number_text(double value);

/// "asphalt, brick, concrete"; after `limit` names "… (12 more)". Names are cut to one line and 60 bytes.
std::string listed(std::span<const std::string> names, std::size_t limit = 40);

}  // namespace sarnerf

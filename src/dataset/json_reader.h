// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <string>
#include <string_view>

namespace sarnerf {

/// Keeps the order of keys, so that what is read and written again stays the same text.
using Json = nlohmann::ordered_json;

/// A JSON value that knows where it stands, so that every complaint does too. Remembers which keys of
/// an object were asked for: finish() refuses the others, which are mostly misspelt.
class JsonReader {
 public:
  /// Parses a document, with or without a byte-order mark. Throws InputError with line and column for bad
  /// syntax, for nesting beyond kDeepestJson, and for objects that hold one key twice or thousands of keys.
  static Json parse(std::string_view text, const std::string& where);

  JsonReader(const Json& value, std::string where);

  bool has(const std::string& key);
  JsonReader at(const std::string& key);     ///< member of an object; InputError when missing
  JsonReader at(std::size_t index) const;    ///< element of an array
  std::size_t array_size() const;            ///< InputError for anything but an array

  double number() const;                     ///< finite
  double positive_number() const;
  int positive_integer() const;
  std::string text() const;

  std::optional<double> optional_number(const std::string& key);
  std::string optional_text(const std::string& key);

  /// Throws InputError naming the first key that nobody asked for.
  void finish() const;

  [[noreturn]] void fail(const std::string& complaint) const;
  const Json& json() const { return value_; }

 private:
  [[noreturn]] void expected(const char* what) const;
  const Json& value_;
  std::string where_;
  std::set<std::string> asked_;
};

}  // namespace sarnerf

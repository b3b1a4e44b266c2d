// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <initializer_list>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <glm/glm.hpp>
#include <nlohmann/json.hpp>

namespace sarnerf {

/// Parses a JSON text, with or without a byte-order mark. Throws InputError with name, line and column for
/// text that is no JSON, for nesting beyond kDeepestJson, and for objects that hold one key twice, of which
/// JSON libraries silently take one.
nlohmann::json parse_json(std::string_view text, const std::string& name);

/// A value inside a JSON document that knows its place, so that every complaint can name it:
/// "street.json: meshes[2].scale: expected a number above 0, found -1". All throw InputError.
class JsonView {
 public:
  /// `value` must outlive the view; `place` begins with the file's name.
  JsonView(const nlohmann::json& value, std::string place)
      : value_(&value), place_(std::move(place)) {}

  /// Refuses keys that are not among the known ones, and anything that is no object.
  void only_keys(std::initializer_list<std::string_view> known) const;

  bool has(std::string_view key) const { return value_->contains(key); }
  JsonView at(std::string_view key) const;                   ///< must be there
  std::optional<JsonView> find(std::string_view key) const;  ///< may be missing

  std::vector<JsonView> elements() const;                         ///< of an array
  std::vector<std::pair<std::string, JsonView>> members() const;  ///< of an object

  std::string text() const;
  bool boolean() const;
  double number() const;
  double number_at_least(double least) const;
  double number_above(double bound) const;
  double number_between(double least, double most) const;
  glm::dvec3 vector() const;
  glm::dvec3 vector_within(double bound) const;  ///< no component beyond ±bound

  bool is_text() const { return value_->is_string(); }
  bool is_array() const { return value_->is_array(); }

  /// Checks "format" and "version", the two keys that each of our files begins with.
  void require_format(std::string_view format, int version) const;

  [[noreturn]] void fail(const std::string& message) const;
  [[noreturn]] void expected(const std::string& what) const;
  const std::string& place() const { return place_; }

 private:
  std::string place_of(std::string_view key) const;  ///< "file: outer.inner"

  const nlohmann::json* value_;
  std::string place_;
};

}  // namespace sarnerf

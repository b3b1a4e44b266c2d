// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <initializer_list>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <glm/glm.hpp>
#include <nlohmann/json.hpp>

// nlohmann's classes are compiled once, in json_view.cpp, and not again in each unit that reads or writes JSON: this header is
// precompiled. A unit that is compiled without it instantiates them again.
extern template class nlohmann::basic_json<nlohmann::ordered_map>;
extern template class nlohmann::detail::serializer<nlohmann::ordered_json>;

namespace sarnerf {

/// Rules that depend on the kind of document: the wording of error messages, and the number of keys an object may have.
struct JsonRules {
  const char* not_json;  ///< precedes the parser's message
  const char* object;    ///< "expected …"
  const char* array;
  const char* text;
  std::size_t most_keys = std::numeric_limits<std::size_t>::max();
};

/// Parses a JSON text, with or without a byte-order mark. `Json` is nlohmann::json, whose objects sort their keys, or
/// nlohmann::ordered_json, whose objects keep their order and search it from the front at each new key: limit the keys.
///
/// Throws InputError with `where` for a text that is not JSON (with line and column), for nesting beyond kDeepestJson (with
/// the line), for more keys than the rules allow, and for objects that hold a key twice: JSON libraries silently take one.
template <class Json>
Json parse_json(std::string_view text, const std::string& where, const JsonRules& rules);

/// A value inside a JSON document, with its path, so that every error message can name it:
/// "street.json: meshes[2].scale: expected a number above 0, found -1". All errors are InputErrors.
template <class Json>
class JsonView {
 public:
  /// Value and rules must outlive the view. `place` is the document's name, followed by a path if `inside` is set.
  JsonView(const Json& value, std::string place, const JsonRules& rules, bool inside = false)
      : value_(&value), rules_(&rules), place_(std::move(place)), inside_(inside) {}

  /// Refuses keys that are not among the known ones, and any value that is not an object.
  void only_keys(std::initializer_list<std::string_view> known) const;

  bool has(std::string_view key) const { return value_->contains(key); }
  JsonView at(std::string_view key) const;                   ///< must be there
  std::optional<JsonView> find(std::string_view key) const;  ///< may be missing

  std::size_t array_size() const;                                 ///< of an array
  JsonView at(std::size_t index) const;                           ///< element of an array
  std::vector<JsonView> elements() const;                         ///< of an array
  std::vector<std::pair<std::string, JsonView>> members() const;  ///< of an object

  std::string text() const;
  bool boolean() const;
  double number() const;  ///< finite
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
  const Json& json() const { return *value_; }

 private:
  void require_object() const;
  std::string place_of(std::string_view key) const;  ///< "file: outer.inner"

  const Json* value_;
  const JsonRules* rules_;
  std::string place_;
  bool inside_;
};

extern template class JsonView<nlohmann::json>;
extern template class JsonView<nlohmann::ordered_json>;
extern template nlohmann::json parse_json(std::string_view, const std::string&, const JsonRules&);
extern template nlohmann::ordered_json parse_json(std::string_view, const std::string&, const JsonRules&);

}  // namespace sarnerf

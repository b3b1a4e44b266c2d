// SPDX-License-Identifier: Apache-2.0
#include "json_view.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "sarnerf/core/error.h"
#include "sarnerf/core/text.h"

template class nlohmann::basic_json<nlohmann::ordered_map>;
template class nlohmann::detail::serializer<nlohmann::ordered_json>;

namespace sarnerf {

namespace {

/// Refuses objects with a repeated key, of whose values the library silently keeps one, and objects with too many keys.
template <class Json>
class KeyCheck {
 public:
  KeyCheck(const std::string& where, std::size_t most_keys) : where_(where), most_keys_(most_keys) {}

  bool operator()(int /*depth*/, typename Json::parse_event_t event, const Json& parsed) {
    if (event == Json::parse_event_t::object_start) open_objects_.emplace_back();
    if (event == Json::parse_event_t::object_end) open_objects_.pop_back();
    if (event != Json::parse_event_t::key) return true;
    std::set<std::string>& keys = open_objects_.back();
    const std::string& key = parsed.template get_ref<const std::string&>();
    if (!keys.insert(key).second) {
      throw InputError(where_ + ": the key " + in_quotes(key) + " is given twice in one object; keep one of them");
    }
    if (keys.size() > most_keys_) {
      throw InputError(where_ + ": expected at most " + std::to_string(most_keys_) +
                       " keys in one object, found more; the file is damaged or meant for something else");
    }
    return true;
  }

 private:
  const std::string& where_;
  std::size_t most_keys_;
  std::vector<std::set<std::string>> open_objects_;
};

}  // namespace

template <class Json>
Json parse_json(std::string_view text, const std::string& where, const JsonRules& rules) {
  text = without_byte_order_mark(text, where);
  require_shallow_json(text, where);
  try {
    KeyCheck<Json> check(where, rules.most_keys);
    return Json::parse(text.begin(), text.end(), [&](int depth, typename Json::parse_event_t event, Json& parsed) {
      return check(depth, event, parsed);
    });
  } catch (const nlohmann::json::exception& e) {  // bad syntax, or a number beyond all doubles
    // The library's message begins with its own tag in brackets, and quotes all of a string that does not end.
    std::string message = e.what();
    if (const auto end = message.find("] "); end != std::string::npos) message.erase(0, end + 2);
    throw InputError(where + ": " + rules.not_json + in_one_line(message, 300));
  }
}

template <class Json>
void JsonView<Json>::fail(const std::string& message) const {
  throw InputError(in_one_line(place_ + ": " + message));
}

template <class Json>
void JsonView<Json>::expected(const std::string& what) const {
  const std::string found = value_->dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
  fail("expected " + what + ", found " + in_one_line(found, 60));
}

template <class Json>
void JsonView<Json>::require_object() const {
  if (!value_->is_object()) expected(rules_->object);
}

template <class Json>
void JsonView<Json>::only_keys(std::initializer_list<std::string_view> known) const {
  require_object();
  const std::vector<std::string> names(known.begin(), known.end());
  for (const auto& [key, value] : value_->items()) {
    if (std::find(names.begin(), names.end(), key) != names.end()) continue;
    const std::string close = closest_name(key, names);
    fail("unknown key " + in_quotes(key) + (close.empty() ? "" : " (" + close + "?)") +
         "; known are: " + listed(names));
  }
}

template <class Json>
std::string JsonView<Json>::place_of(std::string_view key) const {
  return place_ + (inside_ ? "." : ": ") + in_one_line(key, 60);
}

template <class Json>
JsonView<Json> JsonView<Json>::at(std::string_view key) const {
  const std::optional<JsonView> found = find(key);
  if (!found) fail("the key " + in_quotes(key) + " is missing");
  return *found;
}

template <class Json>
std::optional<JsonView<Json>> JsonView<Json>::find(std::string_view key) const {
  require_object();
  const auto found = value_->find(key);
  if (found == value_->end()) return std::nullopt;
  return JsonView(*found, place_of(key), *rules_, true);
}

template <class Json>
std::size_t JsonView<Json>::array_size() const {
  if (!value_->is_array()) expected(rules_->array);
  return value_->size();
}

template <class Json>
JsonView<Json> JsonView<Json>::at(std::size_t index) const {
  return {value_->at(index), place_ + "[" + std::to_string(index) + "]", *rules_, inside_};
}

template <class Json>
std::vector<JsonView<Json>> JsonView<Json>::elements() const {
  std::vector<JsonView> views;
  for (std::size_t n = 0; n < array_size(); ++n) views.push_back(at(n));
  return views;
}

template <class Json>
std::vector<std::pair<std::string, JsonView<Json>>> JsonView<Json>::members() const {
  require_object();
  std::vector<std::pair<std::string, JsonView>> views;
  for (const auto& [key, value] : value_->items()) {
    views.emplace_back(key, JsonView(value, place_of(key), *rules_, true));
  }
  return views;
}

template <class Json>
std::string JsonView<Json>::text() const {
  if (!value_->is_string()) expected(rules_->text);
  return value_->template get<std::string>();
}

template <class Json>
bool JsonView<Json>::boolean() const {
  if (!value_->is_boolean()) expected("true or false");
  return value_->template get<bool>();
}

template <class Json>
double JsonView<Json>::number() const {
  if (!value_->is_number()) expected("a number");
  const auto number = value_->template get<double>();
  if (!std::isfinite(number)) expected("a finite number");
  return number;
}

template <class Json>
double JsonView<Json>::number_at_least(double least) const {
  const double value = number();
  if (!(value >= least)) expected("a number of at least " + number_text(least));
  return value;
}

template <class Json>
double JsonView<Json>::number_above(double bound) const {
  const double value = number();
  if (!(value > bound)) expected("a number above " + number_text(bound));
  return value;
}

template <class Json>
double JsonView<Json>::number_between(double least, double most) const {
  const double value = number();
  if (!(value >= least && value <= most)) {
    expected("a number between " + number_text(least) + " and " + number_text(most));
  }
  return value;
}

template <class Json>
glm::dvec3 JsonView<Json>::vector() const {
  if (!value_->is_array() || value_->size() != 3) expected("three numbers in brackets");
  return {at(0).number(), at(1).number(), at(2).number()};
}

template <class Json>
glm::dvec3 JsonView<Json>::vector_within(double bound) const {
  const glm::dvec3 v = vector();
  if (!glm::all(glm::lessThanEqual(glm::abs(v), glm::dvec3(bound)))) {
    expected("three numbers between -" + number_text(bound) + " and " + number_text(bound));
  }
  return v;
}

template <class Json>
void JsonView<Json>::require_format(std::string_view format, int version) const {
  const JsonView found = at("format");
  if (found.text() != format) found.expected("\"" + std::string(format) + "\"");
  const JsonView found_version = at("version");
  if (found_version.number() != version) {
    found_version.expected(std::to_string(version) + ", the version that this program reads");
  }
}

template class JsonView<nlohmann::json>;
template class JsonView<nlohmann::ordered_json>;
template nlohmann::json parse_json(std::string_view, const std::string&, const JsonRules&);
template nlohmann::ordered_json parse_json(std::string_view, const std::string&, const JsonRules&);

}  // namespace sarnerf

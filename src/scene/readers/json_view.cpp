// SPDX-License-Identifier: Apache-2.0
#include "readers/json_view.h"

#include <algorithm>
#include <set>

#include "sarnerf/core/error.h"
#include "sarnerf/core/text.h"

namespace sarnerf {

namespace {

/// What the library says, without its own error codes and in one line.
std::string syntax_complaint(const nlohmann::json::exception& error) {
  std::string text = error.what();
  const std::size_t code_end = text.find("] ");
  if (text.starts_with('[') && code_end != std::string::npos) text.erase(0, code_end + 2);
  // It repeats all of a text that does not end.
  return in_one_line(text, 300);
}

}  // namespace

nlohmann::json parse_json(std::string_view text, const std::string& name) {
  using Json = nlohmann::json;
  text = without_byte_order_mark(text, name);
  require_shallow_json(text, name);
  std::vector<std::set<std::string>> open_objects;
  const auto refuse_double_keys = [&](int, Json::parse_event_t event, Json& parsed) {
    if (event == Json::parse_event_t::object_start) open_objects.emplace_back();
    if (event == Json::parse_event_t::object_end) open_objects.pop_back();
    if (event == Json::parse_event_t::key) {
      const std::string& key = parsed.get_ref<const std::string&>();
      if (!open_objects.back().insert(key).second) {
        throw InputError(name + ": the key " + in_quotes(key) +
                         " stands twice in one object; keep one of them");
      }
    }
    return true;
  };
  try {
    return Json::parse(text.begin(), text.end(), refuse_double_keys);
  } catch (const Json::exception& error) {
    throw InputError(name + ": expected JSON, found a " + syntax_complaint(error));
  }
}

void JsonView::fail(const std::string& message) const {
  throw InputError(in_one_line(place_ + ": " + message));
}

void JsonView::expected(const std::string& what) const {
  const std::string found = value_->dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
  fail("expected " + what + ", found " + in_one_line(found, 60));
}

void JsonView::only_keys(std::initializer_list<std::string_view> known) const {
  if (!value_->is_object()) expected("an object in braces");
  const std::vector<std::string> names(known.begin(), known.end());
  for (const auto& [key, value] : value_->items()) {
    if (std::find(names.begin(), names.end(), key) != names.end()) continue;
    const std::string close = closest_name(key, names);
    fail("unknown key " + in_quotes(key) + (close.empty() ? "" : " (" + close + "?)") +
         "; known are: " + listed(names));
  }
}

std::string JsonView::place_of(std::string_view key) const {
  const bool in_document = place_.find(": ") != std::string::npos;
  return place_ + (in_document ? "." : ": ") + in_one_line(key, 60);
}

JsonView JsonView::at(std::string_view key) const {
  const std::optional<JsonView> found = find(key);
  if (!found) fail("the key " + in_quotes(key) + " is missing");
  return *found;
}

std::optional<JsonView> JsonView::find(std::string_view key) const {
  if (!value_->is_object()) expected("an object in braces");
  const auto found = value_->find(key);
  if (found == value_->end()) return std::nullopt;
  return JsonView(*found, place_of(key));
}

std::vector<JsonView> JsonView::elements() const {
  if (!value_->is_array()) expected("an array in brackets");
  std::vector<JsonView> views;
  for (std::size_t n = 0; n < value_->size(); ++n) {
    views.emplace_back((*value_)[n], place_ + "[" + std::to_string(n) + "]");
  }
  return views;
}

std::vector<std::pair<std::string, JsonView>> JsonView::members() const {
  if (!value_->is_object()) expected("an object in braces");
  std::vector<std::pair<std::string, JsonView>> views;
  for (const auto& [key, value] : value_->items()) {
    views.emplace_back(key, JsonView(value, place_of(key)));
  }
  return views;
}

std::string JsonView::text() const {
  if (!value_->is_string()) expected("a text in quotes");
  return value_->get<std::string>();
}

bool JsonView::boolean() const {
  if (!value_->is_boolean()) expected("true or false");
  return value_->get<bool>();
}

double JsonView::number() const {
  if (!value_->is_number()) expected("a number");
  return value_->get<double>();
}

double JsonView::number_at_least(double least) const {
  const double value = number();
  if (!(value >= least)) expected("a number of at least " + number_text(least));
  return value;
}

double JsonView::number_above(double bound) const {
  const double value = number();
  if (!(value > bound)) expected("a number above " + number_text(bound));
  return value;
}

double JsonView::number_between(double least, double most) const {
  const double value = number();
  if (!(value >= least && value <= most)) {
    expected("a number between " + number_text(least) + " and " + number_text(most));
  }
  return value;
}

glm::dvec3 JsonView::vector() const {
  if (!value_->is_array() || value_->size() != 3) expected("three numbers in brackets");
  const std::vector<JsonView> parts = elements();
  return {parts[0].number(), parts[1].number(), parts[2].number()};
}

glm::dvec3 JsonView::vector_within(double bound) const {
  const glm::dvec3 v = vector();
  if (!glm::all(glm::lessThanEqual(glm::abs(v), glm::dvec3(bound)))) {
    expected("three numbers between -" + number_text(bound) + " and " + number_text(bound));
  }
  return v;
}

void JsonView::require_format(std::string_view format, int version) const {
  const JsonView found = at("format");
  if (found.text() != format) found.expected("\"" + std::string(format) + "\"");
  const JsonView found_version = at("version");
  if (found_version.number() != version) {
    found_version.expected(std::to_string(version) + ", the version that this program reads");
  }
}

}  // namespace sarnerf

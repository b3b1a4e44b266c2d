// SPDX-License-Identifier: Apache-2.0
#include "json_reader.h"

#include <cmath>
#include <limits>
#include <vector>

#include "sarnerf/core/error.h"
#include "sarnerf/core/text.h"

namespace sarnerf {
namespace {

/// Objects that keep their order are searched from the front at each new key.
constexpr std::size_t kMostKeys = 4096;

/// The library silently keeps the first of two values with one key.
class KeyCheck {
 public:
  explicit KeyCheck(const std::string& where) : where_(where) {}

  bool operator()(int /*depth*/, Json::parse_event_t event, const Json& parsed) {
    if (event == Json::parse_event_t::object_start) open_objects_.emplace_back();
    if (event == Json::parse_event_t::object_end) open_objects_.pop_back();
    if (event != Json::parse_event_t::key) return true;
    std::set<std::string>& keys = open_objects_.back();
    const std::string& key = parsed.get_ref<const std::string&>();
    if (!keys.insert(key).second) {
      throw InputError(where_ + ": the key " + in_quotes(key) + " stands twice in one object; keep one of them");
    }
    if (keys.size() > kMostKeys) {
      throw InputError(where_ + ": expected at most " + std::to_string(kMostKeys) +
                       " keys in one object, found more; the file is damaged or meant for something else");
    }
    return true;
  }

 private:
  const std::string& where_;
  std::vector<std::set<std::string>> open_objects_;
};

}  // namespace

Json JsonReader::parse(std::string_view text, const std::string& where) {
  text = without_byte_order_mark(text, where);
  require_shallow_json(text, where);
  try {
    KeyCheck check(where);
    return Json::parse(text.begin(), text.end(),
                       [&](int depth, Json::parse_event_t event, Json& parsed) { return check(depth, event, parsed); });
  } catch (const Json::exception& e) {  // bad syntax, or a number beyond all doubles
    // The library's message opens with its own tag in brackets, and repeats all of a text that does not end.
    std::string message = e.what();
    if (const auto end = message.find("] "); end != std::string::npos) message.erase(0, end + 2);
    throw InputError(where + ": not valid JSON: " + in_one_line(message, 300));
  }
}

JsonReader::JsonReader(const Json& value, std::string where)
    : value_(value), where_(std::move(where)) {}

void JsonReader::fail(const std::string& complaint) const {
  throw InputError(in_one_line(where_ + ": " + complaint));
}

void JsonReader::expected(const char* what) const {
  fail(std::string("expected ") + what + ", found " + in_one_line(value_.dump(), 60));
}

bool JsonReader::has(const std::string& key) {
  if (!value_.is_object()) expected("an object");
  asked_.insert(key);
  return value_.contains(key);
}

JsonReader JsonReader::at(const std::string& key) {
  if (!has(key)) fail("the key \"" + key + "\" is missing");
  const char* joint = where_.ends_with(".json") ? ": " : ".";
  return {value_.at(key), where_ + joint + in_one_line(key, 60)};
}

JsonReader JsonReader::at(std::size_t index) const {
  return {value_.at(index), where_ + "[" + std::to_string(index) + "]"};
}

std::size_t JsonReader::array_size() const {
  if (!value_.is_array()) expected("an array");
  return value_.size();
}

double JsonReader::number() const {
  if (!value_.is_number()) expected("a number");
  const double number = value_.get<double>();
  if (!std::isfinite(number)) expected("a finite number");
  return number;
}

double JsonReader::positive_number() const {
  const double value = number();
  if (!(value > 0.0)) expected("a number above zero");
  return value;
}

int JsonReader::positive_integer() const {
  if (!value_.is_number_integer()) expected("a whole number");
  const double number = value_.get<double>();
  if (!(number >= 1.0 && number <= std::numeric_limits<int>::max())) {
    expected("a whole number above zero");
  }
  return value_.get<int>();
}

std::string JsonReader::text() const {
  if (!value_.is_string()) expected("a text");
  return value_.get<std::string>();
}

std::optional<double> JsonReader::optional_number(const std::string& key) {
  if (!has(key)) return std::nullopt;
  return at(key).number();
}

std::string JsonReader::optional_text(const std::string& key) {
  return has(key) ? at(key).text() : std::string();
}

void JsonReader::finish() const {
  for (const auto& [key, value] : value_.items()) {
    if (!asked_.contains(key)) fail("the key \"" + in_one_line(key, 60) + "\" is unknown; misspelt?");
  }
}

}  // namespace sarnerf

// SPDX-License-Identifier: Apache-2.0
#include "json_reader.h"

#include <cmath>
#include <limits>

#include "sarnerf/core/error.h"
#include "sarnerf/core/input_text.h"

namespace sarnerf {

Json JsonReader::parse(std::string_view text, const std::string& where) {
  text = without_byte_order_mark(text, where);
  require_shallow_json(text, where);
  try {
    return Json::parse(text);
  } catch (const Json::parse_error& e) {
    // The library's message opens with its own tag in brackets.
    std::string message = e.what();
    if (const auto end = message.find("] "); end != std::string::npos) message.erase(0, end + 2);
    throw InputError(where + ": not valid JSON: " + message);
  }
}

JsonReader::JsonReader(const Json& value, std::string where)
    : value_(value), where_(std::move(where)) {}

void JsonReader::fail(const std::string& complaint) const {
  throw InputError(where_ + ": " + complaint);
}

void JsonReader::expected(const char* what) const {
  std::string found = value_.dump();
  if (found.size() > 60) found = found.substr(0, 57) + "...";
  fail(std::string("expected ") + what + ", found " + found);
}

bool JsonReader::has(const std::string& key) {
  if (!value_.is_object()) expected("an object");
  asked_.insert(key);
  return value_.contains(key);
}

JsonReader JsonReader::at(const std::string& key) {
  if (!has(key)) fail("the key \"" + key + "\" is missing");
  const char* joint = where_.ends_with(".json") ? ": " : ".";
  return {value_.at(key), where_ + joint + key};
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
    if (!asked_.contains(key)) fail("the key \"" + key + "\" is unknown; misspelt?");
  }
}

}  // namespace sarnerf

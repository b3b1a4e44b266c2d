// SPDX-License-Identifier: Apache-2.0
#include "html_writer.h"

#include "svg_writer.h"
#include "text_metrics.h"

namespace sarnerf {
namespace {

std::string opening(std::string_view name, std::initializer_list<HtmlAttribute> attributes) {
  std::string out = "<" + std::string(name);
  for (const auto& [attribute, value] : attributes) {
    if (value.empty() && attribute != "alt") continue;
    out += ' ' + std::string(attribute) + "=\"" + html_text(value) + '"';
  }
  return out;
}

}  // namespace

std::string html_text(std::string_view text) { return escaped(clean_text(text)); }

std::string element(std::string_view name, std::initializer_list<HtmlAttribute> attributes,
                    std::string_view inner) {
  const std::string end = "</" + std::string(name) + ">\n";
  return opening(name, attributes) + '>' + std::string(inner) + end;
}

std::string text_element(std::string_view name, std::initializer_list<HtmlAttribute> attributes,
                         std::string_view text) {
  return element(name, attributes, html_text(text));
}

std::string void_element(std::string_view name, std::initializer_list<HtmlAttribute> attributes) {
  return opening(name, attributes) + "/>\n";
}

}  // namespace sarnerf

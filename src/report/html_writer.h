// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <initializer_list>
#include <string>
#include <string_view>
#include <utility>

namespace sarnerf {

/// An attribute's name and its value as the reader means it: the writer escapes.
using HtmlAttribute = std::pair<std::string_view, std::string_view>;

/// Text as HTML and XML show it: clean (see text_metrics.h) and escaped.
std::string html_text(std::string_view text);

/// Writes elements with their ends, so that what is opened is closed: `inner` is markup.
std::string element(std::string_view name, std::initializer_list<HtmlAttribute> attributes,
                    std::string_view inner);

/// The same around a text.
std::string text_element(std::string_view name, std::initializer_list<HtmlAttribute> attributes,
                         std::string_view text);

/// An element that has no end in HTML, as <img …/>.
std::string void_element(std::string_view name, std::initializer_list<HtmlAttribute> attributes);

}  // namespace sarnerf

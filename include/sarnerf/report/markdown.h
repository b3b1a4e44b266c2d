// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <string>
#include <string_view>

#include "sarnerf/report/page.h"

namespace sarnerf {

/// A page with the contents of a Markdown text, so that a result is written once and read as Markdown or in a browser. Of Markdown it
/// takes what the project's documents have:
///
///     # title                   the first paragraph below it becomes the subtitle
///     ## heading, ### heading
///     | table |                 with its line of alignment; rows whose first cell is bold are emphasised
///     ![description](file)      lines of pictures one below the other stand side by side
///     *one line in italics*     right below a table or pictures: its caption
///     > note
///
/// and paragraphs. Bold, code and links become plain text. `picture` reads a file that the text names; the description is also the
/// picture's name. Throws UsageError for a table without its line of alignment or with rows of another length ("line 12: ..."), and
/// what `picture` throws.
Page page_of_markdown(std::string_view text, const std::function<Pixels(const std::string& file)>& picture);

}  // namespace sarnerf

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace sarnerf {

/// The style sheet of a page. Plots keep their palette on dark paper; what is paper, ink or grid in them changes.
std::string page_style();

}  // namespace sarnerf

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>
#include <string_view>

namespace sarnerf {

/// The name that needs the fewest edits to become `name`, case ignored, for messages about unknown names;
/// empty when none comes close. O(length² × names); names of more than 64 characters are passed over.
std::string closest_name(std::string_view name, std::span<const std::string> names);

}  // namespace sarnerf

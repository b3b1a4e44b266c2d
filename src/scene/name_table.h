// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

namespace sarnerf {

/// Names with indices in the order of their first appearance.
class NameTable {
 public:
  std::uint32_t index(std::string_view name) {
    const auto [entry, is_new] =
        index_of_.try_emplace(std::string(name), static_cast<std::uint32_t>(names_.size()));
    if (is_new) names_.emplace_back(name);
    return entry->second;
  }
  const std::string& operator[](std::uint32_t n) const { return names_[n]; }
  const std::vector<std::string>& names() const { return names_; }

 private:
  std::vector<std::string> names_;
  std::unordered_map<std::string, std::uint32_t> index_of_;
};

}  // namespace sarnerf

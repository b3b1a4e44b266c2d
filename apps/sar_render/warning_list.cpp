// SPDX-License-Identifier: Apache-2.0
#include "warning_list.h"

#include <algorithm>
#include <cctype>
#include <vector>

#include "sarnerf/core/format.h"

namespace sarnerf::app {
namespace {

/// Warnings that differ in nothing but figures.
std::string without_figures(std::string text) {
  std::erase_if(text, [](unsigned char c) { return std::isdigit(c) || c == '.' || c == '-' || c == '+' || c == 'e'; });
  return text;
}

}  // namespace

void WarningList::add(const DatasetView& view, std::size_t index, const std::string& text) {
  const std::scoped_lock lock(mutex_);
  Entry& entry = entries_[without_figures(text)];
  if (entry.n_views++ == 0 || index < entry.first) {
    entry.first = index;
    entry.text = text;
    entry.incidence_deg = view.incidence_deg;
    entry.azimuth_deg = view.azimuth_deg;
  }
}

void WarningList::print(Console& console) const {
  constexpr std::size_t kMostLines = 5;
  std::vector<const Entry*> by_view;
  for (const auto& [kind, entry] : entries_) by_view.push_back(&entry);
  std::stable_sort(by_view.begin(), by_view.end(),
                   [](const Entry* a, const Entry* b) { return a->first < b->first; });
  std::size_t n = 0;
  for (const Entry* entry : by_view) {
    char place[120];
    std::snprintf(place, sizeof place, "%s, first at incidence %.6g, azimuth %.6g deg: ",
                  counted(entry->n_views, "view").c_str(), entry->incidence_deg, entry->azimuth_deg);
    console.warning(place + entry->text);
    if (++n == kMostLines && by_view.size() > kMostLines) {
      console.warning("and " + counted(by_view.size() - kMostLines, "kind") + " of warnings more");
      break;
    }
  }
}

}  // namespace sarnerf::app

// SPDX-License-Identifier: Apache-2.0
#include "summary.h"

#include <algorithm>
#include <cstdio>

#include "sarnerf/core/format.h"

namespace sarnerf::app {
namespace {

template <class... Values>
std::string line(const char* format, Values... values) {
  char text[400];
  std::snprintf(text, sizeof text, format, values...);
  return text;
}

/// "least" or "least to most", of a property of the images.
template <class Of>
std::string span_text(const std::vector<Source>& sources, const char* format, Of of) {
  const auto [least, most] =
      std::minmax_element(sources.begin(), sources.end(),
                          [&](const Source& a, const Source& b) { return of(a) < of(b); });
  const std::string from = line(format, of(*least)), to = line(format, of(*most));
  return from == to ? from : from + " to " + to;
}

/// Sources [begin, end) are one set, in the order of azimuth.
std::string set_line(const std::vector<Source>& all, std::size_t begin, std::size_t end) {
  const DatasetView& first = all[begin].chip.view;
  const std::vector<Source> set(all.begin() + static_cast<std::ptrdiff_t>(begin),
                                all.begin() + static_cast<std::ptrdiff_t>(end));
  double widest_deg = 0.0, after_deg = 0.0;
  for (std::size_t n = 0; n < set.size(); ++n) {
    const double from = set[n].chip.view.azimuth_deg,
                 to = set[(n + 1) % set.size()].chip.view.azimuth_deg;
    const double gap = n + 1 < set.size() ? to - from : to + 360.0 - from;
    if (gap > widest_deg) widest_deg = gap, after_deg = from;
  }
  const std::string name = (first.class_name.empty() ? "no class" : first.class_name) +
                           (first.serial.empty() ? "" : " " + first.serial);
  return line("  %-16s %zu image%s, depression %g deg (%s), azimuth %s deg", name.c_str(),
              set.size(), set.size() == 1 ? "" : "s", set.front().chip.nominal_depression_deg,
              set.front().chip.depression_is_nominal
                  ? "nominal"
                  : ("measured " +
                     span_text(set, "%.2f",
                               [](const Source& s) { return s.chip.view.depression_deg(); }))
                        .c_str(),
              span_text(set, "%.2f", [](const Source& s) { return s.chip.view.azimuth_deg; })
                  .c_str()) +
         line(", widest gap %.2f deg after %.2f\n", widest_deg, after_deg);
}

}  // namespace

std::string summary_text(const Choice& choice) {
  const std::vector<Source>& all = choice.chosen;
  std::string text;
  for (std::size_t begin = 0, end = 0; begin < all.size(); begin = end) {
    while (end < all.size() && same_set(all[begin], all[end])) ++end;
    text += set_line(all, begin, end);
  }
  const auto of_view = [](auto member) {
    return [member](const Source& s) { return s.chip.view.*member; };
  };
  text += "  size             " + span_text(all, "%d", of_view(&DatasetView::n_azimuth)) + " x " +
          span_text(all, "%d", of_view(&DatasetView::n_range)) + " pixels (azimuth x range)\n";
  text += "  spacing          " + span_text(all, "%.6g", of_view(&DatasetView::azimuth_spacing_m)) +
          " m azimuth, " + span_text(all, "%.6g", of_view(&DatasetView::range_spacing_m)) +
          " m slant range\n";
  if (const auto r = common_resolution(all))
    text += format("  resolution       %.6g m azimuth, %.6g m slant range, window %s\n", r->azimuth_m, r->range_m, text_of(r->window).c_str());
  const auto n_assumed = std::count_if(all.begin(), all.end(),
                                       [](const Source& s) { return s.chip.range_is_assumed; });
  text +=
      "  slant range      " + span_text(all, "%.6g", of_view(&DatasetView::slant_range_m)) + " m";
  if (n_assumed > 0)
    text += ", assumed for " + std::to_string(n_assumed) + " of " + std::to_string(all.size()) +
            " (--slant-range)";
  text += "\n";
  for (const std::string& why : choice.left_out) text += "  left out         " + why + "\n";
  return text;
}

std::string plan_text(const Options& o, const Choice& choice) {
  const char* const reading =
      o.command == Command::images && o.orientation == Orientation::radar
          ? "rows are azimuth, columns slant range, near to far"
          : "rows from far to near range, columns against the rows of azimuth; not mirrored";
  return "plan\n  images           " + std::to_string(choice.chosen.size()) + "\n" +
         summary_text(choice) + "  read as          " + reading + "\n  output           " +
         o.output.string() + "/\n";
}

}  // namespace sarnerf::app

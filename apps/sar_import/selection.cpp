// SPDX-License-Identifier: Apache-2.0
#include "selection.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <set>
#include <tuple>

#include "sarnerf/core/error.h"
#include "sarnerf/core/format.h"
#include "sarnerf/core/input_text.h"

namespace sarnerf::app {
namespace {

/// A set of 17° holds what was measured at 16.6° and 17.4°.
constexpr double kNominal_deg = 0.5;

/// Headers give six decimals; nearer ones are the same direction.
constexpr double kSameAzimuth_deg = 1e-3;

auto order(const Source& s) {
  const DatasetView& v = s.chip.view;
  return std::tie(v.class_name, v.serial, s.chip.nominal_depression_deg, v.azimuth_deg, s.file);
}

std::string number(double value) {
  char text[40];
  std::snprintf(text, sizeof text, "%.6g", value);
  return text;
}

/// "2S1, T72": what there is of something, for messages.
template <class Of>
std::string names(const std::vector<Source>& sources, Of of) {
  std::set<std::string> all;
  for (const Source& s : sources) all.insert(of(s));
  std::string text;
  for (const std::string& one : all)
    text += (text.empty() ? "" : ", ") + (one.empty() ? "(none)" : one);
  return in_one_line(text, 400);
}

/// Keeps what passes, and says what did not.
template <class Keep>
void keep_if(Choice& choice, const std::string& why, Keep keep) {
  const auto n = std::erase_if(choice.chosen, [&](const Source& s) { return !keep(s); });
  if (n > 0)
    choice.left_out.push_back(counted(static_cast<std::uint64_t>(n), "image") + ": " + why);
}

void take_class(Choice& choice, const std::string& wanted) {
  if (wanted.empty()) return;
  const std::string there =
      names(choice.chosen, [](const Source& s) { return s.chip.view.class_name; });
  for (Source& s : choice.chosen)
    if (s.chip.view.class_name.empty()) s.chip.view.class_name = wanted;
  keep_if(choice, "of another class than " + wanted,
          [&](const Source& s) { return s.chip.view.class_name == wanted; });
  if (choice.chosen.empty())
    throw UsageError("--class " + wanted + ": there is none; the classes are " + there);
}

void take_depression(Choice& choice, const std::vector<double>& wanted_deg) {
  for (Source& s : choice.chosen) {
    if (s.chip.nominal_depression_deg > 0.0) continue;
    if (wanted_deg.size() != 1)
      throw UsageError(
          s.file.string() +
          ": the depression is not known; give one, such as --depression 17, or a table "
          "with depression_deg");
    s.chip.nominal_depression_deg = wanted_deg.front();
    s.chip.view.incidence_deg = 90.0 - wanted_deg.front();
  }
  if (wanted_deg.empty()) return;
  const std::string there =
      names(choice.chosen, [](const Source& s) { return number(s.chip.nominal_depression_deg); });
  keep_if(choice, "of another nominal depression", [&](const Source& s) {
    return std::any_of(wanted_deg.begin(), wanted_deg.end(), [&](double d) {
      return std::abs(d - s.chip.nominal_depression_deg) <= kNominal_deg;
    });
  });
  if (choice.chosen.empty())
    throw UsageError("--depression: there is no such image; the depressions are " + there);
}

/// Marks the images of one set that are nearest to the grid.
void mark_nearest(const std::vector<Source>& set, std::size_t begin, std::size_t end,
                  double step_deg, std::vector<char>& taken) {
  const auto n_azimuths = static_cast<int>(std::floor(360.0 / step_deg + 1e-9));
  for (int n = 0; n < n_azimuths; ++n) {
    const double azimuth_deg = n * step_deg;
    std::size_t best = end;
    double best_deg = 0.5 * step_deg;
    for (std::size_t s = begin; s < end; ++s) {
      const double distance_deg = apart_deg(set[s].chip.view.azimuth_deg, azimuth_deg);
      if (taken[s] || distance_deg > best_deg || (best != end && distance_deg == best_deg))
        continue;
      best = s;
      best_deg = distance_deg;
    }
    if (best != end) taken[best] = 1;
  }
}

void take_every(Choice& choice, double step_deg) {
  const std::vector<Source>& all = choice.chosen;
  std::vector<char> taken(all.size(), 0);
  for (std::size_t begin = 0, end = 0; begin < all.size(); begin = end) {
    while (end < all.size() && same_set(all[begin], all[end])) ++end;
    mark_nearest(all, begin, end, step_deg, taken);
  }
  std::vector<Source> kept;
  for (std::size_t n = 0; n < all.size(); ++n)
    if (taken[n]) kept.push_back(all[n]);
  if (kept.size() < all.size())
    choice.left_out.push_back(counted(all.size() - kept.size(), "image") + ": not the nearest to an azimuth of every " +
                              number(step_deg) + " deg");
  choice.chosen = std::move(kept);
}

}  // namespace

bool same_set(const Source& a, const Source& b) {
  return a.chip.view.class_name == b.chip.view.class_name &&
         a.chip.view.serial == b.chip.view.serial &&
         a.chip.nominal_depression_deg == b.chip.nominal_depression_deg;
}

double apart_deg(double a_deg, double b_deg) {
  const double d = std::abs(std::fmod(b_deg - a_deg, 360.0));
  return std::min(d, 360.0 - d);
}

Choice choose(std::vector<Source> sources, const Selection& selection) {
  Choice choice{std::move(sources), {}};
  take_class(choice, selection.class_name);
  take_depression(choice, selection.depression_deg);
  std::sort(choice.chosen.begin(), choice.chosen.end(),
            [](const Source& a, const Source& b) { return order(a) < order(b); });
  if (selection.every_deg) take_every(choice, *selection.every_deg);
  return choice;
}

std::string duplicates_text(const std::vector<Source>& chosen) {
  std::size_t n_pairs = 0;
  std::string example;
  for (std::size_t n = 1; n < chosen.size(); ++n) {
    const Source &a = chosen[n - 1], &b = chosen[n];
    if (!same_set(a, b) ||
        apart_deg(a.chip.view.azimuth_deg, b.chip.view.azimuth_deg) > kSameAzimuth_deg)
      continue;
    if (n_pairs++ == 0)
      example = a.file.filename().string() + " and " + b.file.filename().string() + " at " +
                number(a.chip.view.azimuth_deg) + " deg";
  }
  if (n_pairs == 0) return "";
  return std::to_string(n_pairs) +
         (n_pairs == 1 ? " pair of images has" : " pairs of images have") +
         " the same azimuth, such as " + example + "; all are kept";
}

}  // namespace sarnerf::app

// SPDX-License-Identifier: Apache-2.0
#include "training_options.h"

#include <cmath>
#include <cstdio>
#include <limits>
#include <nlohmann/json.hpp>

#include "sarnerf/core/closest_name.h"
#include "sarnerf/core/error.h"
#include "sarnerf/core/input_text.h"

namespace sarnerf::app {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kAny = std::numeric_limits<double>::max();

/// What is not listed may be anything from 0.
struct Limits {
  const char* name;
  double least, most;
};
constexpr Limits kLimits[] = {
    {"rows_per_step", 1, 1e6},
    {"voxel_size_m", 1e-6, 1e6},
    {"n_levels", 1, 10},
    {"harmonics_degree", 0, 2},
    {"n_prunings", 0, 1000},
    {"final_rate", 1e-9, 1},
    {"ray_spacing", 1e-2, 1e2},
    {"end_depth", 1e-3, kAny},
    {"most_ray_spacing_bins", 1e-2, 1e2},
    {"longest_segment", 1e-2, 1e2},
};

/// Voxels of the scene box at the coarsest level: what carving looks at.
constexpr double kMostVoxels = 4e8;

void require_within_limits(const std::string& name, double value) {
  Limits limits{"", 0.0, kAny};
  for (const Limits& l : kLimits) {
    if (name == l.name) limits = l;
  }
  if (value >= limits.least && value <= limits.most) return;
  char text[160];
  if (limits.most == kAny) {
    std::snprintf(text, sizeof text, ": expected at least %.6g, found %.6g", limits.least, value);
  } else {
    std::snprintf(text, sizeof text, ": expected %.6g to %.6g, found %.6g", limits.least,
                  limits.most, value);
  }
  throw UsageError("--option " + name + text);
}

void require_possible_voxels(const TrainerOptions& training, const TrainingSet& set) {
  const double coarse_m = training.grid.voxel_size_m * std::pow(2.0, training.grid.n_levels - 1);
  const glm::dvec3 size_m = set.box_m.size();
  const double n = std::ceil(size_m.x / coarse_m) * std::ceil(size_m.y / coarse_m) *
                   std::ceil(size_m.z / coarse_m);
  if (training.field != "grid" || n <= kMostVoxels) return;
  char text[200];
  std::snprintf(text, sizeof text,
                "the scene's box of %.4g x %.4g x %.4g m has %.3g voxels of %.3g m to begin with, "
                "more than %.0e; use larger "
                "ones (--option voxel_size_m=...)",
                size_m.x, size_m.y, size_m.z, n, coarse_m, kMostVoxels);
  throw UsageError(text);
}

Json value_of(const std::string& name, const std::string& text, const Json& like) {
  const Json value = Json::parse(text, nullptr, false);
  const bool fits = like.is_string()    ? true
                    : like.is_boolean() ? value.is_boolean()
                    : like.is_number_integer()
                        ? value.is_number_integer()
                        : value.is_number() && std::isfinite(value.get<double>());
  if (!fits)
    throw UsageError("--option " + name + ": expected " +
                     (like.is_boolean()          ? "true or false"
                      : like.is_number_integer() ? "a whole number"
                                                 : "a number") +
                     " such as " + like.dump() + ", found " + in_quotes(text));
  if (!like.is_string() && !like.is_boolean()) require_within_limits(name, value.get<double>());
  return like.is_string() ? Json(text) : value;
}

}  // namespace

TrainerOptions training_options(const Options& o, const TrainingSet& set) {
  TrainerOptions defaults = default_options(set, o.field, o.time_s ? Schedule::clock : Schedule::steps, o.surfaces);
  defaults.seed = o.seed;
  Json json = Json::parse(options_json(defaults));
  std::vector<std::string> names;
  for (const auto& [name, value] : json.items()) names.push_back(name);
  for (const std::string& text : o.training) {
    const auto equals = text.find('=');
    const std::string name = text.substr(0, equals);
    if (equals == std::string::npos)
      throw UsageError("--option: expected NAME=VALUE such as rows_per_step=140, found " +
                       in_quotes(text));
    if (name == "field" || name == "seed")
      throw UsageError("--option " + name + ": has an option of its own, --" + name);
    if (!json.contains(name)) {
      const std::string closest = closest_name(name, names);
      throw UsageError("--option: there is no training option " + in_quotes(name) +
                       (closest.empty() ? "" : " (" + closest + "?)") +
                       "; docs/training.md lists them");
    }
    json[name] = value_of(name, text.substr(equals + 1), json[name]);
  }
  const TrainerOptions training = options_from_json(json.dump());
  require_possible_voxels(training, set);
  return training;
}

}  // namespace sarnerf::app

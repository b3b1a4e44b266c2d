// SPDX-License-Identifier: Apache-2.0
#include "recipe.h"

#include <nlohmann/json.hpp>

#include "process.h"
#include "sarnerf/core/parallel.h"
#include "sarnerf/core/sha256.h"
#include "version.h"

namespace sarnerf::app {
namespace {

template <class Value>
Json or_none(const std::optional<Value>& value) {
  return value ? Json(*value) : Json("none");
}

Json request_of(const Options& o) {
  const Selection& s = o.selection;
  Json j{{"command", name(o.command)}};
  j["choice"] = {
      {"class", s.class_name.empty() ? "any" : s.class_name},
      {"depression_deg", s.depression_deg.empty() ? Json("any") : Json(s.depression_deg)},
      {"every_deg", or_none(s.every_deg)},
      {"crop", or_none(s.crop)}};
  j["slant_range_m"] = o.slant_range_m;
  if (o.command == Command::images) {
    j["images"] = {{"scale", o.scale},
                   {"quantity", name(o.quantity)},
                   {"orientation", name(o.orientation)},
                   {"spacing_m", or_none(o.spacing_m)}};
    if (!o.table.empty())
      j["images"]["table"] = {{"file", o.table.filename().string()},
                              {"sha256", sha256_of_file(o.table)}};
  }
  return valid_text(j);
}

}  // namespace

Json recipe_of(const Options& o, const std::vector<Source>& chosen, const Monitor& monitor) {
  std::vector<std::string> digests(chosen.size());
  parallel_for(chosen.size(), 4, [&](std::size_t begin, std::size_t end, int) {
    for (std::size_t n = begin; n < end; ++n) {
      monitor.check();
      digests[n] = sha256_of_file(chosen[n].file);
    }
  });
  Json files = Json::object();
  for (std::size_t n = 0; n < chosen.size(); ++n)
    files[std::to_string(n)] = {{"file", chosen[n].file.filename().string()},
                                {"sha256", digests[n]}};
  return make_recipe(kProgram, request_of(o), {{"files", files}});
}

std::string report_text(const Options& o, const Choice& choice, std::size_t n_written) {
  const Json j{{"format", "sarnerf-report"},
               {"version", 1},
               {"program", std::string(kProgram) + " " + std::string(kVersion)},
               {"threads", o.shared.n_threads},
               {"images", {{"chosen", choice.chosen.size()}, {"written", n_written}}},
               {"left_out", choice.left_out},
               {"seconds", {{"total", seconds_since_start()}}},
               {"machine", {{"processor", processor_name()}}},
               {"memory_bytes", {{"peak", peak_memory_bytes()}}}};
  return j.dump(2) + "\n";
}

}  // namespace sarnerf::app

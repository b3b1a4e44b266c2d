// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/mpa/integrator.h"

#include <array>
#include <string>
#include <utility>

#include "sarnerf/core/error.h"

namespace sarnerf {
namespace {

constexpr std::array<std::pair<Integrator, std::string_view>, 4> kNames{{
    {Integrator::exact, "exact"},
    {Integrator::midpoint, "midpoint"},
    {Integrator::paper, "paper"},
    {Integrator::paper_gated, "paper-gated"},
}};

}  // namespace

std::string_view name(Integrator integrator) {
  for (const auto& [value, text] : kNames) {
    if (value == integrator) return text;
  }
  return "unknown";
}

Integrator integrator_from_name(std::string_view name) {
  std::string known;
  for (const auto& [value, text] : kNames) {
    if (text == name) return value;
    known += (known.empty() ? "" : ", ") + std::string(text);
  }
  throw UsageError("unknown integrator '" + std::string(name) + "'; choose one of " + known);
}

}  // namespace sarnerf

// SPDX-License-Identifier: Apache-2.0
#include "resolution_archive.h"

#include <cmath>

#include "archive_text.h"

namespace sarnerf {
namespace {

constexpr const char* kName = "impulse_response";

}  // namespace

void add_resolution(Archive& archive, const Resolution& r) {
  add_text(archive, kName, {{"resolution_m", {r.azimuth_m, r.range_m}}, {"window", text_of(r.window)}});
}

std::optional<Resolution> resolution_of(const Archive& archive, const std::string& where) {
  if (!Json::parse(archive.json, nullptr, false).contains(kName)) return std::nullopt;
  const Json text = text_of(archive, kName, where);
  const auto m = member<std::vector<double>>(text, "resolution_m", where);
  if (m.size() != 2 || !(m[0] > 0.0) || !(m[1] > 0.0) || !std::isfinite(m[0] + m[1]))
    throw CheckpointError(where + ": the impulse response has no resolution; the file is damaged");
  try {
    return Resolution{m[0], m[1], window_from_text(member<std::string>(text, "window", where))};
  } catch (const UsageError& e) {
    throw CheckpointError(where + ": " + e.what());
  }
}

}  // namespace sarnerf

// SPDX-License-Identifier: Apache-2.0
#include "metrics_log.h"

#include <cerrno>
#include <cstring>
#include <fstream>
#include <nlohmann/json.hpp>

#include "sarnerf/core/atomic_file.h"
#include "sarnerf/core/error.h"

namespace sarnerf::app {
namespace {

using Json = nlohmann::ordered_json;

std::string text_of(const MetricsLine& line) {
  Json j{{"step", line.step}, {"seconds", line.seconds}};
  if (line.loss) j["loss"] = *line.loss;
  if (line.psnr_db) j["psnr_power_db"] = *line.psnr_db;
  return j.dump() + "\n";
}

/// Nothing for a line that was cut off.
std::optional<MetricsLine> line_of(const std::string& text) {
  const Json j = Json::parse(text, nullptr, false);
  const auto number = [&](const char* name) -> std::optional<double> {
    if (!j.contains(name) || !j[name].is_number()) return std::nullopt;
    return j[name].get<double>();
  };
  if (!j.is_object() || !number("step") || !number("seconds")) return std::nullopt;
  return MetricsLine{static_cast<std::int64_t>(*number("step")), *number("seconds"), number("loss"),
                     number("psnr_power_db")};
}

}  // namespace

MetricsLog::MetricsLog(std::filesystem::path path, std::int64_t last_step)
    : path_(std::move(path)) {
  std::ifstream old(path_);
  std::string kept;
  for (std::string text; std::getline(old, text);) {
    const auto line = line_of(text);
    if (!line || line->step > last_step) continue;
    lines_.push_back(*line);
    kept += text_of(*line);
  }
  old.close();
  write_file_atomically(path_, kept, Durability::process);
  file_.reset(std::fopen(path_.c_str(), "a"));
  if (!file_) throw Error(path_.string() + ": cannot be written: " + std::strerror(errno));
}

void MetricsLog::add(const MetricsLine& line) {
  lines_.push_back(line);
  const std::string text = text_of(line);
  if (std::fwrite(text.data(), 1, text.size(), file_.get()) != text.size() ||
      std::fflush(file_.get()) != 0)
    throw Error(path_.string() + ": cannot be written: " + std::strerror(errno) +
                "; free some space, the run can be continued");
}

}  // namespace sarnerf::app

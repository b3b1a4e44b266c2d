// SPDX-License-Identifier: Apache-2.0
#include "checkpoint.h"

#include <nlohmann/json.hpp>

#include "sarnerf/core/error.h"

namespace sarnerf::app {
namespace {

using Json = nlohmann::ordered_json;
constexpr const char* kFormat = "sarnerf-checkpoint";
constexpr int kVersion = 2;

}  // namespace

Archive checkpoint_of(const Trainer& trainer, const RunState& state) {
  Archive archive = trainer.checkpoint();
  // The optimiser's moments are handed out as they are, and the next step changes them in place.
  for (auto& [name, tensor] : archive.tensors) tensor = tensor.detach().clone();
  Json json = Json::parse(archive.json);
  json["run"] = {{"format", kFormat},
                 {"version", kVersion},
                 {"dataset_sha256", state.dataset_sha256},
                 {"progress", state.progress},
                 {"seconds", state.seconds},
                 {"trained_s", state.trained_s},
                 {"finished", state.finished},
                 {"time_s", state.time_s},
                 {"steps", state.steps}};
  archive.json = json.dump();
  return archive;
}

RunState run_state(const Archive& archive, const std::string& where) {
  const Json json = Json::parse(archive.json, nullptr, false);
  if (!json.is_object() || !json.contains("run") || !json["run"].is_object())
    throw CheckpointError(where + ": is not a checkpoint of a training run");
  const Json& run = json["run"];
  try {
    if (run.at("format").get<std::string>() != kFormat)
      throw CheckpointError(where + ": is not a checkpoint of a training run");
    const int version = run.at("version").get<int>();
    if (version > kVersion)
      throw CheckpointError(where + ": is of version " + std::to_string(version) +
                            ", and this program knows versions up to " + std::to_string(kVersion) +
                            "; use the program that wrote it");
    if (version < kVersion)
      throw CheckpointError(where + ": is of version " + std::to_string(version) +
                            ", and this program goes on from version " + std::to_string(kVersion) +
                            "; begin again with --overwrite");
    return {run.at("dataset_sha256").get<std::string>(),
            run.at("progress").get<double>(),
            run.at("seconds").get<double>(),
            run.at("trained_s").get<double>(),
            run.at("finished").get<bool>(),
            run.at("time_s").get<double>(),
            run.at("steps").get<std::int64_t>()};
  } catch (const nlohmann::json::exception&) {
    throw CheckpointError(where + ": what it says of its run is incomplete; the file is damaged");
  }
}

bool all_finite(const Archive& archive) {
  for (const auto& [name, tensor] : archive.tensors) {
    if (tensor.is_floating_point() && !tensor.isfinite().all().item<bool>()) return false;
  }
  return true;
}

}  // namespace sarnerf::app

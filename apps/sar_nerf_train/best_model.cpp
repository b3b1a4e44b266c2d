// SPDX-License-Identifier: Apache-2.0
#include "best_model.h"

#include <nlohmann/json.hpp>

#include "sarnerf/core/error.h"

namespace sarnerf::app {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kPerSchedule = 10.0;  ///< times that fields are judged: each costs as much as many steps
constexpr double kLeastGain_db = 0.02;  ///< less is no improvement
constexpr const char* kPrefix = "best.";

int place(double progress) { return static_cast<int>(progress * kPerSchedule); }

}  // namespace

bool BestModel::due(double progress) const {
  return patience_ > 0.0 && place(progress) > n_judged_;
}

void BestModel::judge(const LearnedField& field, double psnr_db, double progress,
                      std::int64_t step) {
  n_judged_ = place(progress);
  if (field_ && psnr_db < psnr_db_ + kLeastGain_db) return;
  psnr_db_ = psnr_db;
  progress_ = progress;
  step_ = step;
  field_ = field.state();
  // The next step changes the field's numbers in place.
  for (auto& [name, tensor] : field_->tensors) tensor = tensor.detach().clone();
}

bool BestModel::worn_out(double progress) const {
  return field_ && progress - progress_ > patience_;
}

std::unique_ptr<LearnedField> BestModel::field() const {
  return field_ ? restore_field(*field_, "the best model") : nullptr;
}

void BestModel::add_to(Archive& archive) const {
  if (!field_) return;
  Json json = Json::parse(archive.json);
  json["best"] = {{"judged", n_judged_},
                  {"psnr_power_db", psnr_db_},
                  {"progress", progress_},
                  {"step", step_},
                  {"field", Json::parse(field_->json)}};
  archive.json = json.dump();
  for (const auto& [name, tensor] : field_->tensors) archive.tensors[kPrefix + name] = tensor;
}

void BestModel::restore(const Archive& archive, const std::string& where) {
  const Json json = Json::parse(archive.json, nullptr, false);
  if (!json.is_object() || !json.contains("best")) return;
  try {
    const Json& best = json.at("best");
    n_judged_ = best.at("judged").get<int>();
    psnr_db_ = best.at("psnr_power_db").get<double>();
    progress_ = best.at("progress").get<double>();
    step_ = best.at("step").get<std::int64_t>();
    field_.emplace();
    field_->json = best.at("field").dump();
  } catch (const nlohmann::json::exception&) {
    throw CheckpointError(where +
                          ": what it says of its best model is incomplete; the file is damaged");
  }
  for (const auto& [name, tensor] : archive.tensors) {
    if (name.starts_with(kPrefix))
      field_->tensors[name.substr(std::string(kPrefix).size())] = tensor;
  }
  (void)restore_field(*field_, where);
}

}  // namespace sarnerf::app

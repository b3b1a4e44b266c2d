// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <map>
#include <sstream>
#include <vector>

#include "version.h"
#include <nlohmann/json.hpp>

#include "options.h"
#include "output_files.h"
#include "output_lock.h"
#include "sarnerf/core/error.h"
#include "sarnerf/core/files.h"
#include "sarnerf/core/text.h"
#include "sarnerf/nerf/model_file.h"
#include "training_run.h"
#include "values.h"

namespace sarnerf::app {

bool RunFolder::occupied() const {
  const auto paths = {model(), checkpoints(), config(), trial(), metrics(), report(), page(), pictures()};
  std::error_code ignored;
  return std::any_of(paths.begin(), paths.end(),
                     [&](const auto& path) { return std::filesystem::exists(path, ignored); });
}

void RunFolder::clear_reports() const {
  std::filesystem::remove(report());
  std::filesystem::remove(page());
  remove_files(pictures(), [](const auto& path) {
    const std::string name = path.filename().string();
    return path.extension() == ".png" && (name.starts_with("view_") || name.starts_with("despeckled_"));
  });
}

void RunFolder::clear() const {
  clear_reports();
  std::filesystem::remove(model());
  std::filesystem::remove(metrics());
  std::filesystem::remove(trial());
  std::filesystem::remove(checkpoint());
  std::filesystem::remove(config());
}

void RunFolder::prepare() const {
  make_folder(checkpoints());
  make_folder(pictures());
  for (const auto& folder : {folder_, checkpoints(), pictures()})
    remove_files(folder, AtomicFiles::is_temporary);
}

namespace {

using Json = nlohmann::ordered_json;

/// TOML's basic strings have the syntax of JSON's.
std::string quoted(const std::string& text) {
  return Json(text).dump(-1, ' ', false, Json::error_handler_t::replace);
}

std::map<std::string, std::string> settings(const std::string& text, const std::string& where) {
  std::istringstream in(text);
  std::map<std::string, std::string> values;
  for (const FlatItem& item : read_flat_toml(in, where)) {
    for (const std::string& value : item.values) {
      const auto equals = item.name == "option" ? value.find('=') : std::string::npos;
      if (equals != std::string::npos) {
        values["option " + value.substr(0, equals)] = value.substr(equals + 1);
      } else {
        values[item.name] = value;
      }
    }
  }
  return values;
}

}  // namespace

std::string config_text(const Options& o, const TrainerOptions& training) {
  std::ostringstream out;
  out << "# sar_nerf_train " << kVersion
      << ": with --config FILE -o RUN this makes the same run again\n";
  out << "dataset = " << quoted(full_path(o.dataset).string()) << "\n";
  out << "field = " << quoted(o.field) << "\n";
  if (o.time_s) {
    out << "time = " << quoted(Json(*o.time_s).dump() + "s") << "\n";
  } else {
    out << "steps = " << o.steps << "\n";
  }
  out << "seed = " << o.seed << "\n";
  if (o.heights.ground_m) out << "ground-height = " << quoted(Json(*o.heights.ground_m).dump()) << "\n";
  if (o.heights.above_ground_m) out << "scene-height = " << quoted(Json(*o.heights.above_ground_m).dump()) << "\n";
  if (!o.resolution.automatic) {
    const auto& r = o.resolution.resolution;
    out << "resolution = " << quoted(r ? Json(r->azimuth_m).dump() + "," + Json(r->range_m).dump() : "none") << "\n";
    if (r) out << "window = " << quoted(text_of(r->window)) << "\n";
  }
  if (o.registers) out << "register = " << quoted(*o.registers ? "on" : "off") << "\n";
  out << "holdout = " << quoted(o.holdout.text) << "\n";
  if (o.patience > 0.0) out << "patience = " << quoted(Json(o.patience).dump()) << "\n";
  if (!o.against.empty()) out << "against = " << quoted(full_path(o.against).string()) << "\n";
  if (!o.lpips.empty()) out << "lpips = " << quoted(full_path(o.lpips).string()) << "\n";
  if (o.despeckle_deg > 0.0) out << "despeckle = " << quoted(Json(o.despeckle_deg).dump()) << "\n";
  out << "option = [";
  bool first = true;
  const Json options = Json::parse(options_json(training));
  for (const auto& [name, value] : options.items()) {
    if (name == "field" || name == "seed") continue;
    out << (first ? "\n" : ",\n") << "  "
        << quoted(name + "=" + (value.is_string() ? value.get<std::string>() : value.dump()));
    first = false;
  }
  out << "\n]\n";
  return out.str();
}

std::string config_difference(const std::filesystem::path& found, const std::string& wanted,
                              bool with_length) {
  const auto there = settings(read_whole_file(found), found.string());
  const auto now = settings(wanted, "the options");
  std::string text;
  const auto add = [&](const std::string& name, const std::string& a, const std::string& b) {
    if (!with_length && (name == "steps" || name == "time")) return;
    text += (text.empty() ? "" : "; ") + name + ": " + a + " there, " + b + " now";
  };
  for (const auto& [name, value] : now) {
    const auto match = there.find(name);
    if (match == there.end()) {
      add(name, "nothing", value);
    } else if (match->second != value) {
      add(name, match->second, value);
    }
  }
  for (const auto& [name, value] : there) {
    if (!now.contains(name)) add(name, value, "nothing");
  }
  return text;
}

namespace {

bool is_there(const std::filesystem::path& path) {
  std::error_code ignored;
  return std::filesystem::exists(path, ignored);
}

/// Whether the model can be read. If not, it is made again from the checkpoint.
bool is_whole_model(const std::filesystem::path& path) {
  try {
    (void)read_model(path);
    return true;
  } catch (const CheckpointError&) {
    return false;
  }
}

[[noreturn]] void refuse(const RunFolder& folder, const std::string& why) {
  throw UsageError(folder.path().string() + ": another run is in the way (" + why +
                   "); choose another folder (-o) or allow --overwrite");
}

/// Refuses a run of other options. With --resume, the options for the length of training may be raised.
void compare(const Options& o, const RunFolder& folder, const std::string& config) {
  const std::string differs = config_difference(folder.config(), config, !o.resume);
  if (differs.empty()) return;
  if (o.resume)
    throw UsageError("--resume " + folder.path().string() +
                     ": only --steps and --time may change (" + differs +
                     "); leave other options out");
  const bool only_length = config_difference(folder.config(), config, false).empty();
  refuse(folder, differs + (only_length ? "; sar_nerf_train --resume " + folder.path().string() +
                                              " with that option goes on"
                                        : ""));
}

void require_longer(const Options& o, const RunState& state) {
  if (!o.time_s && o.steps < state.steps)
    throw UsageError("--steps " + std::to_string(o.steps) + ": the run has done " +
                     std::to_string(state.steps) + " already; ask for more");
  const bool same_end = state.finished && o.time_s == state.time_s;
  const double taken_s = std::max(state.seconds, state.finished ? state.time_s : 0.0);
  if (o.time_s && !same_end && *o.time_s <= taken_s)
    throw UsageError(format("--time: the run has taken %.4g s already; allow more", taken_s));
}

}  // namespace

void check_place(const Options& o, const RunFolder& folder) {
  if (is_there(folder.path()) && !std::filesystem::is_directory(folder.path()))
    throw UsageError(folder.path().string() +
                     ": expected a place for a folder, found a file; choose another -o");
  refuse_inside(folder.path(), std::vector{o.dataset, o.against});
  require_possible(folder.path());
  if (!folder.occupied() || o.overwrite) return;
  if (!is_there(folder.config())) refuse(folder, "files without a config.toml");
}

Start start_run(const Options& o, const RunFolder& folder, const std::string& config,
                const std::string& fingerprint, Console& console) {
  Start start;
  if (o.overwrite) folder.clear();
  if (is_there(folder.config())) {
    compare(o, folder, config);
    if (is_there(folder.checkpoint())) {
      try {
        start.checkpoint = read_archive(folder.checkpoint());
      } catch (const CheckpointError& error) {
        throw CheckpointError(std::string(error.what()) + "; sar_nerf_train of its dataset, -o " + folder.path().string() + " and --overwrite begin again");
      }
      const RunState state = run_state(*start.checkpoint, folder.checkpoint().string());
      if (state.dataset_sha256 != fingerprint)
        refuse(folder, "it was trained on other images: the dataset has changed since");
      require_longer(o, state);
      const bool same_length = config_difference(folder.config(), config, true).empty();
      start.done = state.finished && same_length && is_there(folder.report()) && is_whole_model(folder.model());
      if (start.done) return start;
      const bool complete = o.time_s ? o.time_s == state.time_s : state.steps >= o.steps;
      if (state.finished && same_length && complete)
        console.note(folder.path().string() + ": trained, but its model or report is missing or damaged: they are made again");
      else
        console.note("continuing after " + counted(static_cast<std::uint64_t>(state.steps), "step"));
    } else {
      folder.clear();
    }
    folder.clear_reports();
  }
  write_file_atomically(folder.config(), config);
  return start;
}

}  // namespace sarnerf::app

// SPDX-License-Identifier: Apache-2.0
#include "job.h"

#include <nlohmann/json.hpp>

#include "nerf_common.h"
#include "output_files.h"
#include "output_lock.h"
#include "process.h"
#include "sarnerf/core/files.h"
#include "sarnerf/core/error.h"
#include "sarnerf/core/text.h"
#include "sarnerf/evaluation/baseline.h"
#include "sarnerf/evaluation/evaluation.h"
#include "sarnerf/dataset/manifest.h"
#include "sarnerf/dataset/posed_image.h"
#include "torch_setup.h"
#include "version.h"

namespace sarnerf::app {

namespace {

std::filesystem::path training_folder(const Job& job) {
  return job.options.training.empty() ? std::filesystem::path(job.model.info.dataset) : job.options.training;
}

}  // namespace

std::vector<PosedImage> training_images(const Job& job, const Monitor& monitor) {
  const ModelInfo& info = job.model.info;
  const std::filesystem::path folder = training_folder(job);
  const Dataset dataset = read_manifest(folder);
  if (dataset_fingerprint(folder, dataset, monitor) != info.dataset_sha256)
    throw InputError(folder.string() + ": is not the dataset that the model was learned from: its SHA-256 is another");
  // Outliers are limited as in training.
  std::vector<PosedImage> images = load_images(folder, dataset, trained_views(dataset.views, info.training_views), monitor);
  limit_outliers(images);
  return images;
}

namespace {

/// The training images for the baselines, registered to one another if their poses are not exact, as sar_nerf_train does it; none, with
/// a warning, if they no longer exist.
std::vector<PosedImage> images_for_baselines(const Job& job, Console& console, const Monitor& monitor) {
  try {
    std::vector<PosedImage> images = training_images(job, monitor);
    if (!read_manifest(training_folder(job)).exact_poses) register_views(images, kCut_pixels, 0.0, monitor);
    return images;
  } catch (const InputError& e) {
    if (!job.options.training.empty()) throw;
    console.warning(std::string("no baselines, for the training images are not there any more (") +
                    e.what() + "); --training FOLDER says where");
    return {};
  }
}

/// The views to predict. Throws UsageError if they show another place, have another calibration, or were all trained on.
std::vector<PosedImage> truth_images(const Job& job, Console& console, const Monitor& monitor) {
  const Options& o = job.options;
  const ModelInfo& info = job.model.info;
  const Dataset dataset = read_manifest(o.against);
  const std::string name = "--against " + o.against.string();
  if (glm::distance(dataset.aim_m, info.aim_m) > 1e-3)
    throw UsageError(
        name +
        ": its aim point is another than the model's, so its images do not show the same place");
  if (dataset.unfinished()) console.warning(name + ": " + unfinished_text(dataset));
  if (dataset.calibration != info.calibration)
    throw UsageError(name + ": holds " + std::string(sarnerf::name(dataset.calibration)) +
                     ", and the model renders " + std::string(sarnerf::name(info.calibration)) +
                     "; compare images of one calibration");
  const auto unseen = unseen_views(dataset.views, info.training_views);
  const std::size_t n_seen = dataset.views.size() - unseen.size();
  if (unseen.empty())
    throw UsageError(name +
                     ": the model was trained on all its views, so none is left to compare with");
  if (n_seen > 0)
    console.note(name + ": " + counted(n_seen, "view") +
                 " with the angles of a training view left out");
  std::vector<PosedImage> images = load_images(o.against, dataset, unseen, monitor);
  for (const Outlier& outlier : limit_outliers(images)) console.warning(outlier_text(outlier, images));
  return images;
}

std::filesystem::path evaluation_file(const Job& job, const Json& request) {
  const std::filesystem::path folder = job.options.output;
  const auto file = folder / "evaluation.json";
  if (std::filesystem::exists(folder) && !std::filesystem::is_directory(folder))
    throw UsageError(folder.string() +
                     ": expected a place for a folder, found a file; choose another -o");
  require_possible(folder);
  refuse_inside(folder, std::vector{job.options.against, job.options.training});
  if (job.options.overwrite || !std::filesystem::exists(file)) return file;
  const Json found = Json::parse(read_whole_file(file), nullptr, false);
  const Json old = found.is_object() ? found.value("request", Json()) : Json();
  if (const std::string differs = difference(old, request); !differs.empty())
    throw UsageError(file.string() + ": another comparison is in the way (" + differs +
                     "); choose another folder (-o) or allow --overwrite");
  return file;
}

}  // namespace

std::string compare(const Job& job, Console& console, const Monitor& monitor) {
  const Options& o = job.options;
  if (job.model.field->occupied_box_m().empty())
    throw CheckpointError(o.model.string() + ": the field has no occupied voxels, and black images cannot be scored; train it anew");
  const ImageDistance lpips = load_lpips(o.lpips);
  const std::vector<PosedImage> truth = truth_images(job, console, monitor);
  const Dataset against = read_manifest(o.against);
  Json request{{"model", job.request.at("model")},
               {"against", dataset_fingerprint(o.against, against, monitor)}};
  const auto despeckled = despeckled_if_asked(o.despeckle_deg, truth, against.exact_poses, monitor);
  if (despeckled) request["despeckle_deg"] = o.despeckle_deg;
  if (!o.lpips.empty()) request["lpips"] = o.lpips.filename().string();
  std::filesystem::path file;
  std::optional<OutputLock> lock;
  if (!o.output.empty()) {
    file = evaluation_file(job, request);
    make_folder(file.parent_path());
    lock.emplace(std::vector{file});
  }
  const std::vector<PosedImage> training = images_for_baselines(job, console, monitor);

  std::vector<Image<float>> predictions;
  for (const PosedImage& view : truth) {
    monitor.check();
    predictions.push_back(render_view(*job.model.field, view.acquisition));
    monitor.report("predict views", predictions.size(), truth.size());
  }
  EvaluationSettings settings;
  settings.peak_power = job.model.info.peak_power;
  settings.baselines = default_baselines(training, monitor);
  const std::string missing = lpips_missing(o.lpips, truth);
  if (missing.empty()) {
    settings.lpips = lpips;
    use_torch_threads(o.shared.n_threads);
  }
  const Evaluation evaluation = evaluate(truth, predictions, training, settings, monitor);

  std::optional<Evaluation> averaged;
  settings.oracle_registered = !against.exact_poses;
  if (despeckled)
    averaged = evaluate_despeckled(*despeckled, predictions, training, settings, monitor);

  const std::string model = "SAR-NeRF, " + std::string(job.model.field->kind());
  std::string table = counted(truth.size(), "view") + " of " + o.against.string() +
                      ", none of them trained on\n\n" + evaluation_table(evaluation, model);
  if (averaged)
    table += "\n" + despeckled_title(o.despeckle_deg, *despeckled) + "\n\n" +
             evaluation_table(*averaged, model);
  if (!missing.empty()) table += "\nno LPIPS: " + missing + "\n";
  if (!file.empty()) {
    Json j{{"format", "sarnerf-evaluation"},
           {"version", 1},
           {"program", std::string(kProgram) + " " + std::string(kVersion)},
           {"request", request}};
    j.update(evaluation_json(evaluation));
    if (averaged) j["despeckled"] = evaluation_json(*averaged);
    if (!missing.empty()) j["lpips_missing"] = missing;
    write_file_atomically(file, j.dump(2) + "\n");
  }
  if (o.shared.verbosity >= 0) return table;
  return file.empty() ? "" : file.string() + "\n";
}

}  // namespace sarnerf::app

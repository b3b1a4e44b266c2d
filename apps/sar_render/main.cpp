// SPDX-License-Identifier: Apache-2.0
#include <nlohmann/json.hpp>

#include "app_main.h"
#include "job.h"
#include "options.h"
#include "output_files.h"
#include "sarnerf/scene/scene.h"
#include "sweep.h"

namespace sarnerf::app {
namespace {

/// Whether the output is of the same request.
bool continues(const Options& options, const Json& request) {
  const auto file = options.sweep() ? SweepFolder(sweep_folder(options), 1).recipe() : image_paths(options).recipe;
  const std::optional<Json> recipe = read_recipe(file);
  return recipe && difference(recipe->value("request", Json()), request).empty();
}

void run(const Options& options, Console& console) {
  const Stopwatch total;
  const Monitor monitor{[&](std::string_view stage, std::uint64_t done, std::uint64_t n) {
                          console.progress(stage, done, n);
                        },
                        &stop_requested()};
  // Before the file is opened for its fingerprint.
  require_scene_file(options.scene);
  const Json request = request_of(options);
  if (!options.dry_run) {
    options.sweep() ? check_sweep(options, request) : check_single_view(options, request);
    require_volume_place(options, continues(options, request));
  }
  Job job = prepare(options, console, monitor);
  if (options.dry_run) {
    print_result(explain(job, output_text(options)) + "\n");
    return;
  }
  // The files that the scene names are known now: none of them may be overwritten.
  options.sweep() ? check_sweep(job.options, request) : check_single_view(job.options, request);
  if (options.explain) console.asked_for(explain(job, output_text(options)));
  const std::string result = options.sweep() ? write_sweep(job, request, total, console, monitor)
                                             : write_single_view(job, request, total, console, monitor);
  print_result(result);
}

}  // namespace
}  // namespace sarnerf::app

int main(int argc, char** argv) {
  using namespace sarnerf::app;
  return app_main("sar_render", argc, argv, parse_options, run);
}

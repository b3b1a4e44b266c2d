// SPDX-License-Identifier: Apache-2.0
// sar_nerf_bench: quality of learned fields against seconds of training, beside the paper's method of learning.
#include <algorithm>
#include <optional>
#include <span>
#include <vector>

#include "app_main.h"
#include "output_lock.h"
#include "learning.h"
#include "output_files.h"
#include "process.h"
#include "sarnerf/core/files.h"
#include "sarnerf/core/error.h"
#include "sarnerf/core/text.h"
#include "sarnerf/core/parallel.h"
#include "sarnerf/dataset/manifest.h"
#include "sarnerf/nerf/mlp_network.h"
#include "sarnerf/report/plot.h"
#include "study.h"
#include "torch_setup.h"
#include "version.h"

namespace sarnerf::bench {
namespace {

void check_place(const Options& o) {
  std::error_code ignored;
  if (std::filesystem::exists(o.output, ignored) &&
      !std::filesystem::is_directory(o.output, ignored))
    throw UsageError(o.output.string() +
                     ": expected a place for a folder, found a file; choose another -o");
  app::refuse_inside(o.output, std::vector{o.training, o.against});
  app::require_possible(o.output);
  if (!o.overwrite && std::filesystem::exists(o.output / "learning.json", ignored))
    throw UsageError(o.output.string() +
                     ": holds a study; choose another folder (-o) or allow --overwrite");
}

void write(const std::filesystem::path& folder, const nlohmann::ordered_json& environment,
           const LearningStudy& study) {
  nlohmann::ordered_json json{{"environment", environment}};
  json.update(learning_json(study));
  const std::string json_text =
      json.dump(1, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
  const std::string tables = learning_tables(study), diagram = svg(learning_diagram(study));
  AtomicFiles files;
  const auto add = [&](const char* name, const std::string& text) {
    files.add(folder / name, std::as_bytes(std::span(text)));
  };
  add("learning.json", json_text);
  add("learning.md", tables);
  add("learning.svg", diagram);
  files.add(folder / "learning.png", png_of_svg(diagram));
  files.commit();
}

/// The runs that the study would make, one field a line.
std::string plan_text(const Options& o) {
  const Dataset training = read_manifest(o.training), against = read_manifest(o.against);
  double total_s = 0.0;
  std::string text = format("plan\n  learned from  %s of %s\n  scored on     up to %zu of %s of %s\n",
                            counted(training.views.size(), "view").c_str(), o.training.c_str(),
                            std::min(o.n_views, against.views.size()),
                            counted(against.views.size(), "view").c_str(), o.against.c_str());
  for (const auto& [field, times_s] : o.contest) {
    text += format("  %-13s", field.c_str());
    for (const double time_s : times_s) {
      text += format(" %g s", time_s);
      total_s += time_s * o.n_seeds;
    }
    text += ", " + counted(static_cast<std::uint64_t>(o.n_seeds), "seed") + "\n";
  }
  return text + format("  time          %g s of training, and the scoring\n  output        %s/\n", total_s, o.output.c_str());
}

void run(const Options& options, const Loading& loading, app::Console& console) {
  if (options.dry_run) {
    app::print_result(plan_text(options));
    return;
  }
  check_place(options);
  const int n = thread_count();
  app::use_torch_threads(n);
  const double gflop_per_s = blas_gflop_per_s();
  const std::string slow = slow_blas_warning(gflop_per_s / n);
  if (!slow.empty()) console.warning(slow);
  const nlohmann::ordered_json environment{{"program", "sar_nerf_bench " + std::string(app::kVersion)},
                                           {"processor", app::processor_name()},
                                           {"threads", n},
                                           {"libraries", app::torch_text()},
                                           {"blas_gflop_per_s", gflop_per_s},
                                           {"loading_s", loading.seconds}};
  const Monitor monitor{{}, &app::stop_requested()};
  std::string tables;
  std::optional<app::FolderLock> lock;
  study_learning(options, loading, console, monitor, [&](const LearningStudy& study) {
    make_folder(options.output);
    if (!lock) lock.emplace(options.output);
    write(options.output, environment, study);
    tables = learning_tables(study);
  });
  if (options.shared.verbosity < 0) {
    tables.clear();
    for (const char* name : {"learning.json", "learning.md", "learning.svg", "learning.png"})
      tables += (options.output / name).string() + "\n";
  }
  app::print_result(tables);
}

}  // namespace
}  // namespace sarnerf::bench

int main(int argc, char** argv) {
  using namespace sarnerf;
  const bench::Loading loading{app::seconds_since_start(), bench::WorkClock::now_cpu_s()};
  app::Console console("sar_nerf_bench");
  return app::run_program(console, [&] {
    if (argc > 1 && std::string(argv[1]) == "ablation") {
      app::catch_signals();
      bench::run_ablation(argc - 1, argv + 1, console);
      return;
    }
    const auto options = bench::parse_options(argc, argv);
    if (!options) return;
    console.set_verbosity(options->shared.verbosity);
    app::catch_signals();
    const ThreadLimit threads(options->shared.n_threads);
    bench::run(*options, loading, console);
  });
}

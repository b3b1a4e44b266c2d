// SPDX-License-Identifier: Apache-2.0
// sar_nerf_bench: how good learned fields are after how many seconds, beside the paper's way of learning.
#include <span>

#include "exit_code.h"
#include "interrupt.h"
#include "learning_output.h"
#include "output_files.h"
#include "process.h"
#include "sarnerf/core/atomic_file.h"
#include "sarnerf/core/error.h"
#include "sarnerf/core/parallel.h"
#include "sarnerf/nerf/blas_check.h"
#include "sarnerf/report/raster.h"
#include "study.h"
#include "torch_setup.h"
#include "version.h"
#include "work_clock.h"

namespace sarnerf::bench {
namespace {

void check_place(const Options& o) {
  std::error_code ignored;
  if (std::filesystem::exists(o.output, ignored) &&
      !std::filesystem::is_directory(o.output, ignored))
    throw UsageError(o.output.string() +
                     ": expected a place for a folder, found a file; choose another -o");
  for (const auto& input : {o.training, o.against}) {
    if (std::filesystem::equivalent(input, o.output, ignored))
      throw UsageError(o.output.string() + " is a dataset; choose another folder (-o)");
  }
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

void run(const Options& options, const Loading& loading, app::Console& console) {
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
  study_learning(options, loading, console, monitor, [&](const LearningStudy& study) {
    std::filesystem::create_directories(options.output);
    write(options.output, environment, study);
    tables = learning_tables(study);
  });
  app::print_result(tables);
}

}  // namespace
}  // namespace sarnerf::bench

int main(int argc, char** argv) {
  using namespace sarnerf;
  const bench::Loading loading{app::seconds_since_start(), bench::WorkClock::now_cpu_s()};
  app::Console console("sar_nerf_bench");
  return app::run_program(console, [&] {
    const auto options = bench::parse_options(argc, argv);
    if (!options) return;
    console.set_verbosity(options->shared.verbosity);
    app::catch_signals();
    const ThreadLimit threads(options->shared.n_threads);
    bench::run(*options, loading, console);
  });
}

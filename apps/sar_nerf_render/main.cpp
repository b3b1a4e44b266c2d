// SPDX-License-Identifier: Apache-2.0
#include <nlohmann/json.hpp>

#include "compare.h"
#include "exit_code.h"
#include "interrupt.h"
#include "job.h"
#include "process.h"
#include "sarnerf/core/parallel.h"
#include "single_view.h"
#include "sweep.h"
#include "torch_setup.h"

int main(int argc, char** argv) {
  using namespace sarnerf::app;
  seconds_since_start();  // the clock's zero, should the system not tell
  Console console("sar_nerf_render");
  return run_program(console, [&] {
    auto options = parse_options(argc, argv);
    if (!options) return;
    console.set_verbosity(options->shared.verbosity);
    catch_signals();
    const sarnerf::ThreadLimit threads(options->shared.n_threads);
    options->shared.n_threads = sarnerf::thread_count();
    const Job job = prepare(*options);
    use_torch_threads(job.model.field->kind() == "mlp" ? options->shared.n_threads : 1);
    const sarnerf::Monitor monitor{[&](std::string_view stage, std::uint64_t done,
                                       std::uint64_t n) { console.progress(stage, done, n); },
                                   &stop_requested()};
    if (options->explain) console.asked_for(explain(job));
    print_result(!options->against.empty() ? compare(job, console, monitor)
                 : job.views.size() > 1    ? write_sweep(job, console, monitor)
                                           : write_single_view(job, console, monitor));
  });
}

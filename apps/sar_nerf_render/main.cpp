// SPDX-License-Identifier: Apache-2.0
#include <nlohmann/json.hpp>

#include "app_main.h"
#include "compare.h"
#include "job.h"
#include "sarnerf/nerf/mlp_field.h"
#include "single_view.h"
#include "sweep.h"
#include "torch_setup.h"

namespace sarnerf::app {
namespace {

void run(const Options& options, Console& console) {
  const Job job = prepare(options, console);
  const auto* const mlp = dynamic_cast<const MlpField*>(job.model.field.get());
  use_torch_threads(mlp ? options.shared.n_threads : 1);
  if (mlp) warn_of_slow_blas(mlp->kernel(), console);
  const Monitor monitor{[&](std::string_view stage, std::uint64_t done, std::uint64_t n) {
                          console.progress(stage, done, n);
                        },
                        &stop_requested()};
  if (options.dry_run) {
    print_result(explain(job) + "\n");
    return;
  }
  if (options.explain) console.asked_for(explain(job));
  print_result(!options.against.empty() ? compare(job, console, monitor)
               : job.views.size() > 1   ? write_sweep(job, console, monitor)
                                        : write_single_view(job, console, monitor));
}

}  // namespace
}  // namespace sarnerf::app

int main(int argc, char** argv) {
  using namespace sarnerf::app;
  return app_main("sar_nerf_render", argc, argv, parse_options, run);
}

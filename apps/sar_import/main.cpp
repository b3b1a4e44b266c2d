// SPDX-License-Identifier: Apache-2.0
#include "app_main.h"
#include "dataset_output.h"
#include "phoenix_output.h"
#include "summary.h"

namespace sarnerf::app {
namespace {

std::string import_images(const Options& options, Console& console, const Monitor& monitor) {
  Choice choice = choose(find_sources(options, console, monitor), options.selection);
  if (const std::string duplicates = duplicates_text(choice.chosen); !duplicates.empty())
    console.warning(duplicates);
  read_sizes(options, choice.chosen, monitor);
  if (options.dry_run) return plan_text(options, choice);
  if (options.explain) console.asked_for(plan_text(options, choice));
  return write_dataset(options, choice, console, monitor);
}

void run(const Options& options, Console& console) {
  const Monitor monitor{[&](std::string_view stage, std::uint64_t done, std::uint64_t n) {
                          console.progress(stage, done, n);
                        },
                        &stop_requested()};
  const std::string result = options.command == Command::phoenix
                                 ? write_phoenix_chips(options, console, monitor)
                                 : import_images(options, console, monitor);
  if (options.dry_run || options.shared.verbosity >= 0) print_result(result);
}

}  // namespace
}  // namespace sarnerf::app

int main(int argc, char** argv) {
  using namespace sarnerf::app;
  return app_main(kProgram, argc, argv, parse_options, run);
}

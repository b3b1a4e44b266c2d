// SPDX-License-Identifier: Apache-2.0
#include "app_main.h"
#include "job.h"

namespace sarnerf::app {
namespace {

std::string import_images(const Options& options, Console& console, const Monitor& monitor) {
  Choice choice = choose(find_sources(options, console, monitor), options.selection);
  if (const std::string duplicates = duplicates_text(choice.chosen); !duplicates.empty())
    console.warning(duplicates);
  // Chips were read to the end before: find_sources() has checked them.
  if (options.command == Command::images) refuse_beyond_memory(options, choice.chosen);
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
  const bool path_alone = options.shared.verbosity < 0 && !options.dry_run;
  print_result(path_alone ? result.substr(0, result.find('\n') + 1) : result);
}

}  // namespace
}  // namespace sarnerf::app

int main(int argc, char** argv) {
  using namespace sarnerf::app;
  return app_main(kProgram, argc, argv, parse_options, run);
}

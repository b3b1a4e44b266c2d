// SPDX-License-Identifier: Apache-2.0
#include "app_main.h"
#include "job.h"

namespace sarnerf::app {
namespace {

void run(const Options& options, Console& console) {
  const Monitor monitor{[&](std::string_view stage, std::uint64_t done, std::uint64_t n) {
                          console.progress(stage, done, n);
                        },
                        &stop_requested()};
  print_result(extract_and_write(options, console, monitor));
}

}  // namespace
}  // namespace sarnerf::app

int main(int argc, char** argv) {
  using namespace sarnerf::app;
  return app_main("sar_extract", argc, argv, parse_options, run);
}

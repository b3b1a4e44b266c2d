// SPDX-License-Identifier: Apache-2.0
#include "app_main.h"

#include <string>

namespace sarnerf::app {

void take_threads(SharedOptions& options, Console& console) {
  const int asked = options.n_threads, n = thread_count();
  options.n_threads = n;
  if (n == asked) return;
  console.warning(std::to_string(asked) + " threads are more than make sense or can be made here: " +
                  std::to_string(n) + " will work (--threads)");
}

}  // namespace sarnerf::app

// SPDX-License-Identifier: Apache-2.0
#include <sarnerf/core/error.h>
#include <sarnerf/dataset/image_index.h>

/// What is no MATLAB file is refused: the reader is there, and so are its libraries.
int main(int, char** argv) {
  try {
    (void)sarnerf::read_sample(argv[0], 4500.0);
  } catch (const sarnerf::InputError&) {
    return 0;
  }
  return 1;
}

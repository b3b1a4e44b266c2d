// SPDX-License-Identifier: Apache-2.0
#pragma once

// LibTorch and Catch2 both define CHECK. Whoever includes this header gets Catch2's: LibTorch's comes first, goes, and
// its include guards keep it away.
#include <torch/types.h>

#undef CHECK
#include "catch.h"

// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace sarnerf::bench {

/// `sar_bench learning …`: becomes the sar_nerf_bench of the same build or installation, with the
/// arguments behind the study's name. A program of its own because this one loads no LibTorch. Returns
/// only by throwing Error, where that program is missing.
[[noreturn]] void become_learning_bench(int argc, char** argv);

}  // namespace sarnerf::bench

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

namespace sarnerf {

/// Looks at the bytes of a MATLAB file before libmatio does, which believes sizes whatever they are. Passes files of
/// version 5 that end with their last variable and hold nothing but texts and matrices of numbers of at most
/// 2048 × 2048, compressed or not, whose parts are as long as they must be; throws InputError "where: …" for all
/// others, those of version 7.3 (HDF5) by name. Cost: unzipping what is compressed, one variable at a time.
void check_mat_layout(std::string_view file, const std::string& where);

}  // namespace sarnerf

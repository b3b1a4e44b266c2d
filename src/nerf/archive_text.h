// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "sarnerf/core/error.h"
#include "sarnerf/nerf/archive.h"

namespace sarnerf {

using Json = nlohmann::ordered_json;

/// Sets a member of an archive's text.
void add_text(Archive& archive, const std::string& name, const Json& value);

/// A member of an archive's text, an object. Throws CheckpointError.
Json text_of(const Archive& archive, const std::string& name, const std::string& where);

/// A member of an object. Throws CheckpointError when it is missing or of another type.
template <class T>
T member(const Json& object, const std::string& name, const std::string& where) {
  try {
    return object.at(name).get<T>();
  } catch (const nlohmann::json::exception&) {
    throw CheckpointError(where + ": '" + name + "' is missing or of another type than expected; was it written by "
                          "another version?");
  }
}

}  // namespace sarnerf

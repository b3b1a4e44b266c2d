// SPDX-License-Identifier: Apache-2.0
#include "archive_text.h"

namespace sarnerf {

void add_text(Archive& archive, const std::string& name, const Json& value) {
  Json text = Json::parse(archive.json);
  text[name] = value;
  archive.json = text.dump();
}

Json text_of(const Archive& archive, const std::string& name, const std::string& where) {
  const Json text = Json::parse(archive.json, nullptr, false);
  if (!text.is_object()) throw CheckpointError(where + ": its text is no JSON object");
  return member<Json>(text, name, where);
}

}  // namespace sarnerf

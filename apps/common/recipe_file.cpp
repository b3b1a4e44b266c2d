// SPDX-License-Identifier: Apache-2.0
#include "recipe_file.h"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <vector>

#include "version.h"
#include <nlohmann/json.hpp>

#include "sarnerf/core/error.h"
#include "sarnerf/core/files.h"
#include "sarnerf/core/numbers.h"
#include "sarnerf/core/text.h"
#include "sarnerf/dataset/image_file.h"

namespace sarnerf::app {

namespace {

constexpr const char* kFormat = "sarnerf-recipe";
constexpr int kFormatVersion = 1;
constexpr std::size_t kMaxDifferences = 3;

void collect_differences(const Json& found, const Json& wanted, const std::string& place,
                         std::vector<std::string>& list) {
  if (found == wanted) return;
  if (!found.is_object() || !wanted.is_object()) {
    const auto shortened = [](const Json& j) {
      std::string text = j.is_null() ? "nothing" : j.dump();
      return text.size() > 48 ? text.substr(0, 45) + "..." : text;
    };
    list.push_back(place + ": " + shortened(found) + " there, " + shortened(wanted) + " now");
    return;
  }
  const auto member = [](const Json& object, const std::string& key) {
    return object.contains(key) ? object.at(key) : Json();
  };
  const std::string prefix = place.empty() ? "" : place + ".";
  for (const auto& [key, value] : wanted.items()) {
    collect_differences(member(found, key), value, prefix + key, list);
  }
  for (const auto& [key, value] : found.items()) {
    if (!wanted.contains(key)) collect_differences(value, Json(), prefix + key, list);
  }
}

}  // namespace

Json valid_text(const Json& json) {
  return Json::parse(json.dump(-1, ' ', false, Json::error_handler_t::replace));
}

Json make_recipe(const std::string& program, const Json& request, const Json& resolved) {
  return valid_text({{"format", kFormat},
                     {"version", kFormatVersion},
                     {"program", program + " " + std::string(kVersion)},
                     {"request", request},
                     {"resolved", resolved}});
}

std::optional<Json> read_recipe(const std::filesystem::path& path) {
  std::string text;
  try {
    text = read_whole_file(path);
    require_shallow_json(text, path.string());
  } catch (const InputError&) {
    return std::nullopt;
  }
  Json recipe = Json::parse(text, nullptr, false);
  if (!recipe.is_object() || recipe.value("format", Json()) != kFormat) return std::nullopt;
  return recipe;
}

std::string recipe_text(const Json& recipe) { return recipe.dump(2) + "\n"; }

std::string difference(const Json& found, const Json& wanted) {
  std::vector<std::string> list;
  collect_differences(found, wanted, "", list);
  std::string text;
  for (std::size_t n = 0; n < std::min(kMaxDifferences, list.size()); ++n) {
    text += (n > 0 ? "; " : "") + list[n];
  }
  if (list.size() > kMaxDifferences) {
    text += "; and " + std::to_string(list.size() - kMaxDifferences) + " more";
  }
  return text;
}

namespace {

constexpr std::size_t kDigits = 64;

std::string text_of(const std::map<std::string, std::string>& digest_of) {
  std::string lines;
  for (const auto& [name, digest] : digest_of) lines += digest + "  " + name + "\n";
  return lines;
}

}  // namespace

Checksums::Checksums(std::filesystem::path list) : list_(std::move(list)) {
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(list_, ignored)) return;
  std::istringstream in(read_whole_file(list_));
  for (std::string line; std::getline(in, line);) {
    if (in.eof()) break;  // the line was cut off: its name may be the beginning of another name
    // "<64 digits>  <name>"; a later line replaces an earlier one.
    if (line.size() <= kDigits + 2 || line.compare(kDigits, 2, "  ") != 0) continue;
    digest_[line.substr(kDigits + 2)] = line.substr(0, kDigits);
  }
}

bool Checksums::whole(const std::string& name) const {
  const auto known = digest_.find(name);
  if (known == digest_.end()) return false;
  try {
    return sha256_of_file(list_.parent_path() / name) == known->second;
  } catch (const InputError&) {
    return false;
  }
}

bool Checksums::recorded(const std::string& name, std::string_view bytes) const {
  const auto known = digest_.find(name);
  return known != digest_.end() && known->second == sha256_hex(std::as_bytes(std::span(bytes)));
}

void Checksums::add(const std::vector<File>& files) {
  std::map<std::string, std::string> fresh_digest;
  for (const File& file : files) fresh_digest[file.name] = sha256_hex(file.bytes);
  const std::string lines = text_of(fresh_digest);
  const std::scoped_lock lock(mutex_);
  for (auto& [name, digest] : fresh_digest) digest_[name] = std::move(digest);
  if (!out_.is_open()) {
    // A line that was cut off must not merge with the next one.
    std::error_code ignored;
    const bool fresh = !std::filesystem::exists(list_, ignored) || std::filesystem::file_size(list_, ignored) == 0;
    out_.open(list_, std::ios::binary | std::ios::app);
    if (!fresh) out_ << '\n';
  }
  out_ << lines << std::flush;
  if (!out_) throw Error(list_.string() + ": cannot be written; free some space on the disk, then repeat the command");
}

void Checksums::finish() {
  out_.close();
  write_file_atomically(list_, text_of(digest_));
}

namespace {

constexpr std::size_t kMostSamples = 9;

}  // namespace

std::vector<std::size_t> DisplayScale::sample_views(std::size_t n_views) {
  const std::size_t n_samples = std::min(n_views, kMostSamples);
  std::vector<std::size_t> views(n_samples);
  for (std::size_t n = 0; n < n_samples; ++n) views[n] = n * n_views / n_samples;
  return views;
}

DisplayScale::DisplayScale(std::span<const float> white_levels) {
  std::vector<float> levels;
  std::copy_if(white_levels.begin(), white_levels.end(), std::back_inserter(levels),
               [](float level) { return level > 0.0f; });
  if (levels.empty()) return;
  white_ = median(levels);
}

float DisplayScale::white_for(const Image<float>& image) const {
  return white_ ? *white_ : white_level(image);
}

Json DisplayScale::text(Quantity quantity) const {
  if (!white_) return "blank";
  // A hundredth of a decibel is finer than a grey level.
  const double white_db = std::round(100.0 * level_db(*white_, quantity)) / 100.0;
  return {{"white_db", white_db}, {"black_db", white_db - DisplayRange{}.range_db}};
}

std::vector<std::byte> make_picture(const Image<float>& image, Quantity quantity, const DisplayScale& scale) {
  return encode_png(display_levels(image, quantity, scale.white_for(image)));
}

}  // namespace sarnerf::app

// SPDX-License-Identifier: Apache-2.0
#include "files/archives.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <span>

#include <torch/csrc/jit/serialization/pickle.h>
#include <zip.h>

#include "field/tensors.h"
#include "sarnerf/core/error.h"
#include "sarnerf/core/files.h"
#include "sarnerf/nerf/learned_field.h"

namespace sarnerf {

namespace {

constexpr const char* kText = "json";

/// Whether the bytes are a zip archive, as LibTorch writes them, in which every file matches its stored CRC-32.
/// LibTorch's own reader skips that check, and does not always notice missing bytes either: a damaged number would be
/// rendered. libzip compares the checksum when a file's last byte is read.
bool is_intact(std::span<const char> bytes) {
  zip_error_t error;
  zip_error_init(&error);
  zip_source_t* const source = zip_source_buffer_create(bytes.data(), bytes.size(), 0, &error);
  zip_t* const opened = source != nullptr ? zip_open_from_source(source, ZIP_RDONLY, &error) : nullptr;
  if (opened == nullptr && source != nullptr) zip_source_free(source);  // else the archive owns it
  zip_error_fini(&error);
  const std::unique_ptr<zip_t, decltype(&zip_discard)> archive(opened, zip_discard);
  if (!archive) return false;
  const zip_int64_t n_files = zip_get_num_entries(archive.get(), 0);
  std::array<char, 1 << 16> part;
  for (zip_int64_t n = 0; n < n_files; ++n) {
    const std::unique_ptr<zip_file_t, decltype(&zip_fclose)> file(
        zip_fopen_index(archive.get(), static_cast<zip_uint64_t>(n), 0), zip_fclose);
    if (!file) return false;
    zip_int64_t n_read = 0;
    while ((n_read = zip_fread(file.get(), part.data(), part.size())) > 0) {
    }
    if (n_read < 0) return false;
  }
  return n_files > 0;
}

}  // namespace

const torch::Tensor& Archive::tensor(const std::string& name, torch::ScalarType type, std::int64_t n_dimensions,
                                     const std::string& where) const {
  const auto found = tensors.find(name);
  if (found == tensors.end())
    throw CheckpointError(where + ": has no tensor '" + name + "'; was it written by another version?");
  const torch::Tensor& t = found->second;
  if (t.scalar_type() != type || t.dim() != n_dimensions)
    throw CheckpointError(where + ": tensor '" + name + "' should have " + std::to_string(n_dimensions) +
                          " dimensions of " + c10::toString(type) + ", found " + std::to_string(t.dim()) + " of " +
                          c10::toString(t.scalar_type()));
  return t;
}

void write_archive(const std::filesystem::path& path, const Archive& archive) {
  c10::impl::GenericDict dictionary(c10::StringType::get(), c10::AnyType::get());
  dictionary.insert(kText, archive.json);
  for (const auto& [name, tensor] : archive.tensors) dictionary.insert(name, tensor.detach().contiguous());
  const std::vector<char> bytes = torch::jit::pickle_save(dictionary);
  AtomicFiles files;
  files.add(path, std::as_bytes(std::span(bytes)));
  files.commit();
}

Archive read_archive(const std::filesystem::path& path) {
  std::vector<char> bytes;
  try {
    const std::string content = read_whole_file(path);
    bytes.assign(content.begin(), content.end());
  } catch (const InputError& e) {
    throw CheckpointError(e.what());
  }
  Archive archive;
  try {
    if (!is_intact(bytes)) throw std::runtime_error("damaged");
    const auto dictionary = torch::jit::pickle_load(bytes).toGenericDict();
    for (const auto& entry : dictionary) {
      const std::string& name = entry.key().toStringRef();
      if (name == kText) {
        archive.json = entry.value().toStringRef();
      } else {
        archive.tensors.emplace(name, entry.value().toTensor());
      }
    }
  } catch (const std::exception&) {
    // LibTorch's own message is a trace of its code, many lines long.
    throw CheckpointError(path.string() + ": is not a model or checkpoint, or is truncated or damaged (" +
                          std::to_string(bytes.size()) + " bytes)");
  }
  return archive;
}

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

void add_ground(Archive& archive, const LevelGround& ground) {
  archive.tensors["ground_texture"] = tensor_of(ground.texture);
  add_text(archive, "ground",
           {{"height_m", ground.height_m},
            {"cell_m", ground.cell_m},
            {"first_m", {ground.first_x_m, ground.first_z_m}},
            {"incidence_rad", ground.incidence_rad},
            {"gain", ground.gain},
            {"noise", ground.noise}});
}

std::shared_ptr<const LevelGround> ground_of(const Archive& archive, const std::string& where) {
  if (archive.tensors.find("ground_texture") == archive.tensors.end()) return nullptr;
  const auto require = [&](bool holds, const char* what) {
    if (!holds) throw CheckpointError(where + ": " + what + "; the file is damaged");
  };
  const torch::Tensor texture = archive.tensor("ground_texture", torch::kFloat, 2, where).contiguous();
  const Json text = text_of(archive, "ground", where);
  auto ground = std::make_shared<LevelGround>();
  ground->height_m = member<double>(text, "height_m", where);
  ground->cell_m = member<double>(text, "cell_m", where);
  const auto first_m = member<std::vector<double>>(text, "first_m", where);
  ground->incidence_rad = member<std::vector<double>>(text, "incidence_rad", where);
  ground->gain = member<std::vector<double>>(text, "gain", where);
  if (text.contains("noise")) ground->noise = member<double>(text, "noise", where);  // models of 2026-11-28 and before have none
  require(texture.numel() > 0 && texture.isfinite().all().item<bool>(), "the ground's texture is empty or not finite");
  require(first_m.size() == 2 && ground->cell_m > 0.0 && std::isfinite(ground->height_m),
          "the ground's first cell, cell size or height is missing or not finite");
  require(!ground->gain.empty() && ground->gain.size() == ground->incidence_rad.size() &&
              std::is_sorted(ground->incidence_rad.begin(), ground->incidence_rad.end()),
          "the ground's gains do not belong to its incidences");
  require(std::isfinite(ground->noise) && ground->noise >= 0.0, "the noise of the ground's image is below 0 or not finite");
  ground->first_x_m = first_m[0];
  ground->first_z_m = first_m[1];
  ground->texture = image_of(texture);
  return ground;
}

namespace {

constexpr const char* kName = "impulse_response";

}  // namespace

void add_resolution(Archive& archive, const Resolution& r) {
  add_text(archive, kName, {{"resolution_m", {r.azimuth_m, r.range_m}}, {"window", text_of(r.window)}});
}

std::optional<Resolution> resolution_of(const Archive& archive, const std::string& where) {
  if (!Json::parse(archive.json, nullptr, false).contains(kName)) return std::nullopt;
  const Json text = text_of(archive, kName, where);
  const auto m = member<std::vector<double>>(text, "resolution_m", where);
  if (m.size() != 2 || !(m[0] > 0.0) || !(m[1] > 0.0) || !std::isfinite(m[0] + m[1]))
    throw CheckpointError(where + ": the impulse response has no resolution; the file is damaged");
  try {
    return Resolution{m[0], m[1], window_from_text(member<std::string>(text, "window", where))};
  } catch (const UsageError& e) {
    throw CheckpointError(where + ": " + e.what());
  }
}

void add_voxels(Archive& archive, const BrickTopology& topology,
                std::span<const std::uint32_t> active) {
  const auto n_bricks = static_cast<std::int64_t>(topology.n_bricks());
  torch::Tensor bricks = torch::empty({n_bricks, 3}, torch::kInt);
  int* out = bricks.data_ptr<int>();
  for (std::uint32_t b = 0; b < n_bricks; ++b)
    for (int axis = 0; axis < 3; ++axis) *out++ = topology.coordinate(b)[axis];
  torch::Tensor voxels = torch::empty({static_cast<std::int64_t>(active.size())}, torch::kLong);
  std::copy(active.begin(), active.end(), voxels.data_ptr<std::int64_t>());
  archive.tensors["bricks"] = bricks;
  archive.tensors["voxels"] = voxels;
}

CarvedVoxels voxels_of(const Archive& archive, const std::string& where) {
  const auto require = [&](bool holds, const char* what) {
    if (!holds) throw CheckpointError(where + ": " + what + "; the file is damaged");
  };
  const torch::Tensor bricks = archive.tensor("bricks", torch::kInt, 2, where).contiguous();
  const torch::Tensor voxels = archive.tensor("voxels", torch::kLong, 1, where).contiguous();
  require(bricks.size(1) == 3, "a brick does not have three coordinates");
  CarvedVoxels result;
  const int* b = bricks.data_ptr<int>();
  for (std::int64_t n = 0; n < bricks.size(0); ++n, b += 3) {
    const glm::ivec3 brick(b[0], b[1], b[2]);
    require(glm::all(glm::lessThanEqual(glm::abs(brick), glm::ivec3(kMaxBrick))),
            "a brick's coordinate is too large");
    require(result.topology.insert(brick) == n, "a brick is stored twice");
  }
  result.active.assign(result.topology.n_bricks() * kBrickVoxels, 0);
  std::int64_t last = -1;
  const auto* v = voxels.data_ptr<std::int64_t>();
  for (std::int64_t n = 0; n < voxels.size(0); ++n) {
    require(v[n] > last && v[n] < static_cast<std::int64_t>(result.active.size()),
            "voxels are not in order");
    result.active[static_cast<std::size_t>(last = v[n])] = 1;
  }
  return result;
}

}  // namespace sarnerf

// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <cstring>
#include <optional>
#include <set>

#include "sarnerf/core/error.h"
#include "sarnerf/core/text.h"
#include "vdb/vdb_layouts.h"

namespace sarnerf {

namespace {

constexpr std::string_view kFormat = "sarnerf-volume";
constexpr std::int64_t kVersion = 1;

/// Axes and units that the file states, else those of the options.
struct Frame {
  UpAxis up = UpAxis::y;
  double metres_per_unit = 1.0;
};

class OwnLayout {
 public:
  explicit OwnLayout(VdbReading& reading) : reading_(reading), file_(reading.file()) {}

  std::unique_ptr<VdbScene::Grids> read() {
    check_version();
    frame_ = frame();
    choose_basis();
    grids_->extinction = load_numbers("extinction", ValueRule::not_negative, optical_scale());
    grids_->extinction_back =
        load_numbers("extinction_back", ValueRule::not_negative, optical_scale());
    read_source();
    grids_->component = load<openvdb::Int32Grid>("component", require_components);
    for (const char* of_body : {"distance", "unseen", "occupancy"})  // of a body's shape, which rendering does not use
      if (find(of_body) != nullptr) used_.insert(of_body);
    read_scene_box();
    keep_metadata();
    say_what_is_left();
    return std::move(grids_);
  }

 private:
  [[noreturn]] void fail(const std::string& message) const {
    throw InputError(file_.name + ": " + message);
  }

  const VdbFileGrid* find(const std::string& name) const {
    const VdbFileGrid* found = nullptr;
    for (const VdbFileGrid& grid : file_.grids) {
      if (grid.name != name) continue;
      if (found) fail("expected one grid \"" + name + "\", found several; rename or delete the others");
      found = &grid;
    }
    return found;
  }

  void check_version() const {
    const auto format = text_entry(file_.metadata, "format");
    if (!format) {
      reading_.notes.push_back(file_.name + ": has no metadata 'format'; its grids are taken for what "
                                            "their names say, with values in 1/m");
      return;
    }
    if (*format != kFormat) {
      fail("expected the format \"" + std::string(kFormat) + "\", found " + in_quotes(*format));
    }
    const auto version = integer_entry(file_.metadata, "version");
    if (version != kVersion) {
      fail("expected version " + std::to_string(kVersion) + " of the format, found " +
           (version ? std::to_string(*version) : std::string("none")) + "; use the release that wrote it");
    }
  }

  Frame frame() const {
    Frame frame{reading_.options.up, reading_.options.units_m};
    if (const auto up = text_entry(file_.metadata, "up_axis")) {
      if (*up != "y" && *up != "z") fail("expected up_axis \"y\" or \"z\", found " + in_quotes(*up));
      frame.up = *up == "z" ? UpAxis::z : UpAxis::y;
      if (frame.up != reading_.options.up && reading_.options.up != UpAxis::y) {
        reading_.notes.push_back(file_.name + ": its metadata state that " + *up + " is up; --up is not used");
      }
    }
    if (const auto units = text_entry(file_.metadata, "units")) {
      if (*units != "m") fail("expected units \"m\", found " + in_quotes(*units));
      frame.metres_per_unit = 1.0;
      if (reading_.options.units_m != 1.0) {
        reading_.notes.push_back(file_.name + ": its metadata state that it is in metres; --units is not used");
      }
    }
    frame.metres_per_unit *= reading_.options.scale;
    return frame;
  }

  /// Factor on extinction and scattering that keeps optical depths, so that a scaled scene is opaque where the
  /// original is.
  double optical_scale() const { return 1.0 / reading_.options.scale; }

  void choose_basis() {
    const bool scatters = find("scattering") != nullptr;
    const bool bright = find("brightness") != nullptr;
    const auto basis = text_entry(file_.metadata, "brightness_basis");
    if (scatters && bright) fail("expected either \"scattering\" or \"brightness\", found both");
    if (!scatters && !bright) {
      fail("expected \"scattering\" or \"brightness\" beside \"extinction\", found neither; a volume "
           "without them returns no backscatter. Grids: " + listed_grids(file_));
    }
    if (scatters) {
      if (basis) fail("found brightness_basis " + in_quotes(*basis) + " but no grid \"brightness\"");
      grids_->basis = SourceBasis::scattering;
      return;
    }
    if (find("extinction") == nullptr) {
      fail("expected \"extinction\" beside \"brightness\", found none; brightness belongs to matter that "
           "absorbs");
    }
    if (!basis) {
      fail("expected metadata brightness_basis (isotropic, sh or cosine) with \"brightness\", found none");
    }
    if (*basis == "cosine") {
      grids_->basis = SourceBasis::cosine;
    } else if (*basis == "isotropic" || *basis == "sh") {
      grids_->basis = SourceBasis::harmonics;
    } else {
      fail("expected brightness_basis isotropic, sh or cosine, found " + in_quotes(*basis));
    }
    n_brightness_ = 1;
    while (find("brightness_" + std::to_string(n_brightness_)) != nullptr) ++n_brightness_;
    check_coefficients(*basis);
  }

  void check_coefficients(const std::string& basis) {
    const bool single = basis != "sh";
    if (single ? n_brightness_ != 1 : n_brightness_ != 1 && n_brightness_ != 4 && n_brightness_ != 9) {
      fail("expected " + std::string(single ? "1" : "1, 4 or 9") + " grids of brightness for the basis " +
           basis + ", found " + std::to_string(n_brightness_));
    }
    for (int n = n_brightness_ + 1; n <= kMaxHarmonics; ++n) {
      if (find("brightness_" + std::to_string(n)) != nullptr) {
        fail("found \"brightness_" + std::to_string(n) + "\" but not \"brightness_" +
             std::to_string(n_brightness_) + "\"");
      }
    }
    grids_->harmonics_degree = n_brightness_ == 9 ? 2 : n_brightness_ == 4 ? 1 : 0;
    if (grids_->harmonics_degree > 0 && frame_.up == UpAxis::z) {
      fail("expected harmonics in axes with y up, found z up; turn volume and coefficients where they were "
           "made");
    }
  }

  void read_source() {
    if (grids_->basis == SourceBasis::scattering) {
      grids_->scattering =
          load_numbers("scattering", ValueRule::not_negative, optical_scale());
      return;
    }
    // A single coefficient of harmonics may have any sign: only the sum is clamped.
    const ValueRule rule = n_brightness_ > 1 ? ValueRule::finite : ValueRule::not_negative;
    for (int n = 0; n < n_brightness_; ++n) {
      const std::string name = n == 0 ? "brightness" : "brightness_" + std::to_string(n);
      grids_->brightness.push_back(load_numbers(name, rule, 1.0));
    }
    if (grids_->basis != SourceBasis::cosine) return;
    grids_->normal = load<openvdb::Vec3SGrid>("normal", require_vectors);
    grids_->exponent = load_numbers("exponent", ValueRule::not_negative, 1.0);
    if (!grids_->normal || !grids_->exponent) {
      fail("expected \"normal\" and \"exponent\" with the basis cosine, found " + listed_grids(file_));
    }
    if (frame_.up == UpAxis::z) turn_vectors_from_z_up(*grids_->normal);
  }

  /// The grid after place_grid(), or null; `check(grid, where)` gets it as stored in the file.
  template <class Grid, class Check>
  typename Grid::Ptr load(const std::string& name, const Check& check) {
    const VdbFileGrid* found = find(name);
    if (!found) return nullptr;
    used_.insert(name);
    const std::string where = reading_.place(*found);
    typename Grid::Ptr grid = reading_.loader.load<Grid>(*found);
    check(*grid, where);
    const VdbPlacement placement =
        placement_of(grid->transform(), frame_.up, frame_.metres_per_unit, where);
    if (!placement_) {
      placement_ = placement;
    } else if (!same_lattice(*placement_, placement)) {
      fail("expected all grids on the same voxels, found " + in_quotes(name) +
           " with another voxel size or origin; resample it");
    }
    place_grid(grid, *placement_, where);
    return grid;
  }

  openvdb::FloatGrid::Ptr load_numbers(const std::string& name, ValueRule rule, double factor) {
    auto grid = load<openvdb::FloatGrid>(name, [&](const openvdb::FloatGrid& found, const std::string& where) {
      require_values(found, rule, factor, where);
    });
    if (grid && factor != 1.0) multiply_values(*grid, factor);
    return grid;
  }

  void read_scene_box() {
    const auto least = vector_entry(file_.metadata, "scene_box_min_m");
    const auto most = vector_entry(file_.metadata, "scene_box_max_m");
    if (!least || !most) return;
    for (const auto& [x, y, z] : {*least, *most}) {
      if (!std::isfinite(x + y + z)) fail("expected finite numbers in scene_box_min_m and scene_box_max_m");
      const glm::dvec3 p = frame_.up == UpAxis::y ? glm::dvec3(x, y, z) : glm::dvec3(x, z, -y);
      reading_.scene_box_m.include(frame_.metres_per_unit * p);
    }
  }

  void keep_metadata() {
    for (const auto& [name, value] : file_.metadata) {
      if (value.type == "string") {
        grids_->metadata.insertMeta(name, openvdb::StringMetadata(std::string(value.bytes)));
      } else if (value.type == "double" && value.bytes.size() == sizeof(double)) {
        double number;
        std::memcpy(&number, value.bytes.data(), sizeof number);
        grids_->metadata.insertMeta(name, openvdb::DoubleMetadata(number));
      } else if (const auto number = integer_entry(file_.metadata, name)) {
        grids_->metadata.insertMeta(name, openvdb::Int64Metadata(*number));
      } else if (const auto text = entry_as_text(value)) {
        grids_->metadata.insertMeta(name, openvdb::StringMetadata(*text));
      }
    }
  }

  void say_what_is_left() {
    std::vector<std::string> left;
    for (const VdbFileGrid& grid : file_.grids) {
      if (!used_.contains(grid.name)) left.push_back(in_quotes(grid.name));
    }
    if (!left.empty()) reading_.notes.push_back(file_.name + ": grids not used: " + listed(left));
  }

  VdbReading& reading_;
  const VdbFile& file_;
  std::unique_ptr<VdbScene::Grids> grids_ = std::make_unique<VdbScene::Grids>();
  Frame frame_;
  std::optional<VdbPlacement> placement_;
  std::set<std::string> used_;
  int n_brightness_ = 0;
};

}  // namespace

bool has_own_layout(const VdbFile& file) {
  if (text_entry(file.metadata, "format") == kFormat) return true;
  return std::any_of(file.grids.begin(), file.grids.end(), [](const VdbFileGrid& grid) {
    return grid.name == "extinction" || grid.name == "scattering" || grid.name == "brightness";
  });
}

std::unique_ptr<VdbScene::Grids> read_own_layout(VdbReading& reading) { return OwnLayout(reading).read(); }

}  // namespace sarnerf

// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/dataset/image_index.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cmath>
#include <new>
#include <set>

#include <csv.h>

#include "csv_table.h"
#include "sarnerf/core/error.h"
#include "sarnerf/core/files.h"
#include "sarnerf/core/text.h"
#include "sarnerf/dataset/image_file.h"
#include "sarnerf/dataset/manifest.h"
#include "sarnerf/dataset/posed_image.h"

namespace sarnerf {

namespace {

using Rows = std::vector<std::vector<std::string>>;

/// For libcsv, which calls take_field() and end_row() from C: no exception may pass through it.
struct Collector {
  Rows rows{1};
  bool out_of_memory = false;
};

void take_field(void* field, std::size_t size, void* target) noexcept {
  auto& collector = *static_cast<Collector*>(target);
  try {
    collector.rows.back().emplace_back(static_cast<const char*>(field), size);
  } catch (const std::bad_alloc&) {
    collector.out_of_memory = true;
  }
}

void end_row(int, void* target) noexcept {
  auto& collector = *static_cast<Collector*>(target);
  try {
    collector.rows.emplace_back();
  } catch (const std::bad_alloc&) {
    collector.out_of_memory = true;
  }
}

Rows parse(std::string_view text, const std::string& where) {
  csv_parser parser;
  if (csv_init(&parser, CSV_STRICT | CSV_STRICT_FINI) != 0) throw std::bad_alloc();
  Collector collector;
  const bool whole = csv_parse(&parser, text.data(), text.size(), take_field, end_row,
                               &collector) == text.size() &&
                     csv_fini(&parser, take_field, end_row, &collector) == 0;
  const bool out_of_memory = collector.out_of_memory || csv_error(&parser) == CSV_ENOMEM;
  csv_free(&parser);
  if (out_of_memory) throw std::bad_alloc();
  if (!whole)
    throw InputError(where + ": row " + std::to_string(collector.rows.size() - 1) +
                     ": a quote does not close, or stands inside of an unquoted field; quotes in "
                     "fields are doubled");
  if (collector.rows.back().empty()) collector.rows.pop_back();
  return std::move(collector.rows);
}

}  // namespace

CsvTable::CsvTable(std::string_view text, std::string where) : where_(std::move(where)) {
  rows_ = parse(without_byte_order_mark(text, where_), where_);
  if (rows_.empty()) fail("the table is empty; expected a line with the names of its columns");
  names_ = std::move(rows_.front());
  rows_.erase(rows_.begin());
  for (std::size_t n = 0; n < names_.size(); ++n)
    if (!names_[n].empty() &&
        std::find(names_.begin(), names_.begin() + n, names_[n]) != names_.begin() + n)
      fail("the column " + in_quotes(names_[n]) + " is listed twice");
  for (std::size_t row = 0; row < rows_.size(); ++row)
    if (rows_[row].size() != names_.size())
      fail(row, "expected " + std::to_string(names_.size()) +
                    " fields, one for each column, found " + std::to_string(rows_[row].size()));
}

std::optional<std::size_t> CsvTable::place(std::string_view column) const {
  const auto found = std::find(names_.begin(), names_.end(), column);
  if (found == names_.end()) return std::nullopt;
  return static_cast<std::size_t>(found - names_.begin());
}

bool CsvTable::has(std::string_view column) const { return place(column).has_value(); }

const std::string& CsvTable::text(std::size_t row, std::string_view column) const {
  static const std::string kNothing;
  const auto n = place(column);
  return n ? rows_[row][*n] : kNothing;
}

std::optional<double> CsvTable::number(std::size_t row, std::string_view column) const {
  const std::string& field = text(row, column);
  if (field.empty()) return std::nullopt;
  double value = 0.0;
  const auto [rest, error] = std::from_chars(field.data(), field.data() + field.size(), value);
  if (error != std::errc() || rest != field.data() + field.size() || !std::isfinite(value))
    fail(row, std::string(column) + ": expected a number, found " + in_quotes(field));
  return value;
}

void CsvTable::fail(const std::string& what) const { throw InputError(where_ + ": " + what); }

void CsvTable::fail(std::size_t row, const std::string& what) const {
  fail("row " + std::to_string(row + 1) + ": " + what);
}

namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMostNamed = 5;

/// "a, b and 7 more".
std::string list_text(const std::vector<std::string>& names) {
  std::string text;
  for (std::size_t n = 0; n < std::min(kMostNamed, names.size()); ++n)
    text += (n > 0 ? ", " : "") + in_one_line(names[n], 80);
  if (names.size() > kMostNamed)
    text += " and " + std::to_string(names.size() - kMostNamed) + " more";
  return text;
}

std::optional<double> depression_deg(const CsvTable& table, std::size_t row) {
  const auto depression = table.number(row, "depression_deg"),
             incidence = table.number(row, "incidence_deg");
  if (depression && incidence && std::abs(*depression + *incidence - 90.0) > kSameAngle_deg)
    table.fail(row, "depression_deg " + table.text(row, "depression_deg") + " and incidence_deg " +
                        table.text(row, "incidence_deg") +
                        " contradict each other: they must add up to 90");
  const auto angle = depression  ? depression
                     : incidence ? std::optional(90.0 - *incidence)
                                 : std::nullopt;
  if (angle && !is_depression(*angle))
    table.fail(row, "expected a depression between 0 and 90 degrees, both excluded, found " +
                        std::to_string(*angle));
  return angle;
}

std::optional<double> positive(const CsvTable& table, std::size_t row, const char* column) {
  const auto value = table.number(row, column);
  if (value && !(*value > 0.0))
    table.fail(row, std::string(column) + ": expected a number above 0");
  return value;
}

IndexedImage image_of_row(const CsvTable& table, std::size_t row) {
  IndexedImage image;
  const auto azimuth = table.number(row, "azimuth_deg");
  if (!azimuth) table.fail(row, "azimuth_deg is empty: the radar's azimuth is unknown");
  image.azimuth_deg = *azimuth;
  image.depression_deg = depression_deg(table, row);
  image.slant_range_m = positive(table, row, "slant_range_m");
  image.azimuth_spacing_m = positive(table, row, "azimuth_spacing_m");
  image.range_spacing_m = positive(table, row, "range_spacing_m");
  image.class_name = in_one_line(table.text(row, "class"), 60);
  image.serial = in_one_line(table.text(row, "serial"), 60);
  image.split = in_one_line(table.text(row, "split"), 60);
  return image;
}

bool lies_in(const fs::path& file, const fs::path& folder) {
  const fs::path relative =
      fs::weakly_canonical(file).lexically_relative(fs::weakly_canonical(folder));
  return !relative.empty() && *relative.begin() != "..";
}

std::string lower(std::string text) {
  for (char& c : text) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return text;
}

}  // namespace

std::string csv_field(const std::string& text) {
  if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
  std::string field(csv_write(nullptr, 0, text.data(), text.size()), '\0');
  csv_write(field.data(), field.size(), text.data(), text.size());
  return field;
}

std::vector<IndexedImage> read_image_index(const fs::path& path, const fs::path& folder) {
  const CsvTable table(read_whole_file(path), path.string());
  for (const char* column : {"file", "azimuth_deg"})
    if (!table.has(column)) table.fail(std::string("the table has no column ") + column);

  std::vector<IndexedImage> images;
  std::vector<std::string> unknown;
  std::set<fs::path> seen;
  for (std::size_t row = 0; row < table.n_rows(); ++row) {
    const std::string& name = table.text(row, "file");
    if (name.empty() || has_control_characters(name))
      table.fail(row, "file: expected the name of an image");
    std::error_code ignored;
    fs::path file = path.parent_path() / name;
    if (!fs::is_regular_file(file, ignored)) file = folder / name;
    if (!fs::is_regular_file(file, ignored)) {
      unknown.push_back(name);
      continue;
    }
    IndexedImage image = image_of_row(table, row);
    if (!lies_in(file, folder)) continue;
    if (!seen.insert(fs::weakly_canonical(file)).second)
      table.fail(row, "the image " + in_quotes(name) + " is listed twice");
    image.file = file;
    images.push_back(std::move(image));
  }
  if (!unknown.empty())
    table.fail(std::to_string(unknown.size()) + " of " + std::to_string(table.n_rows()) +
               " files exist neither beside the table nor in " + folder.string() + ": " +
               list_text(unknown));
  return images;
}

std::vector<fs::path> image_files(const fs::path& folder) {
  constexpr std::array kEndings{".png", ".jpg", ".jpeg", ".tif", ".tiff"};
  std::vector<fs::path> files;
  walk_folder(folder, [&](const fs::directory_entry& entry) {
    std::error_code ignored;
    const std::string ending = lower(entry.path().extension().string());
    if (entry.is_regular_file(ignored) && std::find(kEndings.begin(), kEndings.end(), ending) != kEndings.end()) files.push_back(entry.path());
    return !(entry.is_directory(ignored) && fs::exists(entry.path() / kManifestName, ignored));
  });
  std::sort(files.begin(), files.end());
  return files;
}

std::vector<IndexedImage> index_by_names(const fs::path& folder) {
  std::vector<IndexedImage> images;
  std::vector<std::string> unreadable;
  for (const fs::path& file : image_files(folder)) {
    const std::string name = file.filename().string();
    const std::size_t end = name.find('_');
    double azimuth_deg = 0.0;
    const char* const stop = name.data() + (end == std::string::npos ? 0 : end);
    const auto [rest, error] = std::from_chars(name.data(), stop, azimuth_deg);
    if (error != std::errc() || rest != stop || !std::isfinite(azimuth_deg)) {
      unreadable.push_back(name);
      continue;
    }
    IndexedImage image;
    image.file = file;
    image.azimuth_deg = azimuth_deg;
    images.push_back(std::move(image));
  }
  if (!unreadable.empty())
    throw InputError(
        folder.string() + ": no azimuth in the names of " + std::to_string(unreadable.size()) +
        (unreadable.size() == 1 ? " image" : " images") +
        ", expected such as 50.2248_HB15087.tif, or a table (--csv): " + list_text(unreadable));
  return images;
}

Chip chip_of(const IndexedImage& indexed, const PictureRule& rule) {
  Chip chip;
  chip.depression_is_nominal = true;
  chip.nominal_depression_deg = indexed.depression_deg.value_or(0.0);
  chip.range_is_assumed = !indexed.slant_range_m;
  DatasetView& view = chip.view;
  view.azimuth_deg = within_circle_deg(indexed.azimuth_deg);
  view.incidence_deg = 90.0 - chip.nominal_depression_deg;
  view.slant_range_m = indexed.slant_range_m.value_or(rule.slant_range_m);
  view.azimuth_spacing_m = indexed.azimuth_spacing_m.value_or(rule.spacing_m ? rule.spacing_m->first : 0.0);
  view.range_spacing_m = indexed.range_spacing_m.value_or(rule.spacing_m ? rule.spacing_m->second : 0.0);
  if (view.azimuth_spacing_m == 0.0 || view.range_spacing_m == 0.0)
    throw UsageError(indexed.file.string() + ": the pixel spacing is not known; give --spacing, such as 0.203,0.202, or "
                                             "a table with azimuth_spacing_m and range_spacing_m");
  view.class_name = indexed.class_name;
  view.serial = indexed.serial;
  view.source = indexed.file.filename().string();
  return chip;
}

void read_pixels(Chip& chip, const fs::path& file, const PictureRule& rule) {
  chip.image = to_radar_axes(read_image(file), rule.axes);
  for (float& value : chip.image.pixels()) {
    value = static_cast<float>(value * rule.scale);
    if (!(value >= 0.0f) || !std::isfinite(value))
      throw InputError(file.string() + ": a pixel is negative or beyond float32; amplitudes and powers are not, and decibels are "
                                       "neither");
  }
  chip.view.n_azimuth = chip.image.n_azimuth();
  chip.view.n_range = chip.image.n_range();
}

}  // namespace sarnerf

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "sarnerf/dataset/manifest.h"
#include "run_program.h"
#include "scratch_folder.h"

/// What a JSON file holds.
nlohmann::json json_of(const std::filesystem::path& file);

/// A folder with a small dataset: 32 × 32 pixels of eight points at the corners of a box, seen at 45° from all sides.
class SmallScene : public ScratchFolder {
 public:
  explicit SmallScene(int n_views = 12);
  explicit SmallScene(const std::filesystem::path& contents) : ScratchFolder(contents) {}

  /// Learns the field grid, without a trial, unless the arguments name another, a run or a configuration.
  Outcome train(const std::vector<std::string>& arguments, const Signal& signal = {}) const;
  Outcome render(const std::vector<std::string>& arguments, const Signal& signal = {}) const;
  Outcome bench(const std::vector<std::string>& arguments) const;
  Outcome run(const std::string& program, const std::vector<std::string>& arguments) const;

  /// Writes another dataset of the same points into a folder.
  void write_dataset(const std::string& name, int n_views, double first_azimuth_deg,
                     int n_pixels = 32) const;

  /// Replaces a piece of a text file, which must be there.
  void edit(const std::string& file, const std::string& piece, const std::string& instead) const;
};

/// A small scene with a model of it in run/, learned in 40 steps from another folder of the same images.
struct LearnedScene : SmallScene {
  LearnedScene();
};

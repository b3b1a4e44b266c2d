// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/types.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "scratch_folder.h"

/// A headless Chromium with an empty profile, driven over two pipes in its DevTools protocol: no port, no driver.
class Browser {
 public:
  explicit Browser(const std::string& program);
  ~Browser();
  Browser(const Browser&) = delete;
  Browser& operator=(const Browser&) = delete;

  /// The window's size in CSS pixels, and whether the reader's system is dark. For pages opened afterwards, and
  /// for the open one.
  void show_as(int width_px, int height_px, bool dark);

  /// Opens a file and waits until all of it is loaded.
  void open(const std::filesystem::path& file);

  /// The value of a JavaScript expression. Throws where it throws.
  nlohmann::json evaluate(const std::string& expression);

  /// The whole page as PNG.
  std::string screenshot();

  /// What the console showed and what scripts threw since open(), and what was asked for beside the page itself.
  const std::vector<std::string>& complaints() const { return complaints_; }
  const std::vector<std::string>& requests() const { return requests_; }

 private:
  nlohmann::json call(const std::string& method,
                      nlohmann::json parameters = nlohmann::json::object());
  nlohmann::json next_message();
  void note_event(const nlohmann::json& message);

  ScratchFolder profile_;
  pid_t process_ = -1;
  int to_browser_ = -1, from_browser_ = -1;
  std::string unread_, session_, url_;
  int last_id_ = 0;
  bool loaded_ = false;
  std::vector<std::string> complaints_, requests_;
};

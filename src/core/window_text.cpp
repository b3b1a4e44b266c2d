// SPDX-License-Identifier: Apache-2.0
#include <charconv>
#include <cmath>
#include <cstdio>
#include <optional>

#include "sarnerf/core/error.h"
#include "sarnerf/core/window.h"

namespace sarnerf {
namespace {

/// Taylor's sidelobes are nearly, not quite, as low as designed.
constexpr double kMostExcessDb = 2.0;

[[noreturn]] void fail(std::string_view text) {
  throw UsageError("--window: expected none, hann, hamming, taylor:DB (such as taylor:-35, or "
                   "taylor:-35,5 with its number of sidelobes) or kaiser:BETA, found '" +
                   std::string(text) + "'");
}

std::optional<double> number(std::string_view text) {
  double value = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(value)) return {};
  return value;
}

std::string shortest(double value) {
  char text[32];
  return {text, std::to_chars(text, text + sizeof text, value).ptr};
}

bool becomes_negative(const Window& window) {
  const Taper taper(window);
  for (int n = 0; n <= 500; ++n) {
    if (taper.weight(n * 1e-3) < 0.0) return true;
  }
  return false;
}

Window taylor(std::string_view text, std::string_view parameters) {
  Window window;
  window.kind = Window::Kind::taylor;
  const auto comma = parameters.find(',');
  const auto level = number(parameters.substr(0, comma));
  if (!level) fail(text);
  window.sidelobe_db = *level;
  if (comma != std::string_view::npos) {
    const auto nbar = number(parameters.substr(comma + 1));
    if (!nbar || *nbar != std::floor(*nbar) || *nbar < 2.0 || *nbar > 30.0) {
      throw UsageError("--window: expected a whole number of sidelobes from 2 to 30 after the level, as in "
                       "taylor:-35,5, found '" + std::string(text) + "'");
    }
    window.nbar = static_cast<int>(*nbar);
  }
  if (!(*level >= -100.0 && *level <= -14.0)) {
    throw UsageError("--window: expected a sidelobe level of -100 to -14 dB (no window has -13.3 dB), found '" +
                     std::string(text) + "'");
  }
  const double reached_db = Taper(window).peak_sidelobe_db();
  if (becomes_negative(window) || reached_db > *level + kMostExcessDb) {
    char reached[32];
    std::snprintf(reached, sizeof reached, "%.1f", reached_db);
    throw UsageError("--window: " + text_of(window) + " has too few sidelobes for its level: it reaches " +
                     reached + " dB; give it more, as in taylor:" + shortest(*level) + "," +
                     std::to_string(window.nbar + 2));
  }
  return window;
}

}  // namespace

Window window_from_text(std::string_view text) {
  Window window;
  if (text == "none") return window;
  if (text == "hann") {
    window.kind = Window::Kind::hann;
  } else if (text == "hamming") {
    window.kind = Window::Kind::hamming;
  } else if (text.starts_with("taylor:")) {
    return taylor(text, text.substr(7));
  } else if (text.starts_with("kaiser:")) {
    const auto beta = number(text.substr(7));
    if (!beta) fail(text);
    if (!(*beta >= 0.0 && *beta <= 50.0)) {
      throw UsageError("--window: expected a beta from 0 to 50, as in kaiser:6, found '" + std::string(text) +
                       "'");
    }
    window.kind = Window::Kind::kaiser;
    window.beta = *beta;
  } else {
    fail(text);
  }
  return window;
}

std::string text_of(const Window& window) {
  switch (window.kind) {
    case Window::Kind::none: return "none";
    case Window::Kind::hann: return "hann";
    case Window::Kind::hamming: return "hamming";
    case Window::Kind::taylor:
      return "taylor:" + shortest(window.sidelobe_db) + "," + std::to_string(window.nbar);
    case Window::Kind::kaiser: return "kaiser:" + shortest(window.beta);
  }
  return {};
}

}  // namespace sarnerf

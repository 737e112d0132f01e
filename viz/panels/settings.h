// Settings that the window keeps from one run to the next, in a small JSON file of the user.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "capture/run/run_settings.h"
#include "viz/render/view_settings.h"

namespace palpate::viz {

struct Settings {
  static constexpr size_t kMostRecent = 12;

  /// A source that was opened, with the sensor file it was read with (empty: none).
  struct Recent {
    std::string input;
    std::string sensor;
    double largest_N = 0;  ///< force when it was open last; 0: none was measured
    bool operator==(const Recent&) const = default;
  };

  uint32_t width = 1280;  ///< of the window, in the screen's units
  uint32_t height = 720;
  ViewSettings view;
  std::vector<Recent> recent;        ///< newest first
  std::vector<std::string> sensors;  ///< sensor files that were used, newest first
  RunSettings run;                   ///< of the next source from the list; not kept from run to run
  std::string folder;                ///< where sessions and snapshots of the start list go; empty: ~/palpate

  /// To the front of the list; the oldest fall off. Paths become absolute.
  void remember(const std::string& input, const std::filesystem::path& sensor);
  void forget(const Recent& recent);
};

/// A path as it is found again from another folder; other inputs as they are.
std::string absolute_input(const std::string& input);

/// PALPATE_CONFIG names the file ("none": nothing is remembered), else it is window.json in
/// $XDG_CONFIG_HOME/palpate, else in ~/.config/palpate. Empty: there is no place.
std::filesystem::path settings_file();

/// Never throws: without a file the defaults; from a damaged one what can be read of it, and `warning` says
/// so in one line.
struct LoadedSettings {
  Settings settings;
  std::string warning;
};
LoadedSettings load_settings(const std::filesystem::path& file);
/// Writes atomically, making the folder; an empty path is no file. Throws Error(Failure::Output).
void save_settings(const Settings& settings, const std::filesystem::path& file);

}  // namespace palpate::viz

// Output of `palpate lump scan`: files, plots and a one-page report.
#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "engine/base/json.h"
#include "engine/palpation/hand/hand_scan.h"
#include "engine/palpation/scan.h"

namespace palpate {

/// A press by hand as people see it.
struct HandRow {
  std::string name;
  std::string left_out;                       ///< why; empty: it is in the map
  std::array<double, 2> at_mm{}, at_sd_mm{};  ///< the window's middle; errors against the first press
  double turn_deg = 0, turn_sd_deg = 0;       ///< from +x towards +y
  HandTilt tilt = {};                         ///< NaN where it is left out
};

/// A scan with all that people want to know of it.
struct ScanReport {
  ScanAnswer answer;
  std::vector<HandRow> hand;                                ///< of a scan by hand: all presses
  std::vector<std::pair<std::string, std::string>> inputs;  ///< name and value, for people
  std::string model;                                        ///< the estimator, with its version; empty: none
  std::optional<fem::Scene> truth;                          ///< of a synthetic block
  std::string made;                                         ///< when, UTC
};

/// Tables for people.
std::string scan_text(const ScanReport& report);
json::Value scan_json(const ScanReport& report);

/// Writes pressure_Pa.npy (loads x height x width), disagreement_Pa.npy, map.csv, presses.csv, outline.csv
/// (of two bumps also outline_2.csv; by hand also hand.csv), scan.json, the plots map and profile (PNG and
/// SVG) and report.html, which needs nothing else. Returns their names in words.
std::string write_scan(const ScanReport& report, const std::filesystem::path& folder);

}  // namespace palpate

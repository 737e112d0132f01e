// Output of a scan (`palpate lump scan`, and of presses by hand the window): files, plots and a one-page
// report.
#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "engine/base/json.h"
#include "engine/palpation/hand/growing_scan.h"
#include "engine/palpation/scan.h"

namespace palpate {

/// A scan with all that people want to know of it.
struct ScanReport {
  ScanReport();
  void take_hand(HandAnswer found);
  // To the inputs:
  void add_block(const std::array<double, 3>& block_mm, double young_Pa);
  void add_errors(const lump::ErrorSources& errors);

  ScanAnswer answer;
  std::vector<HandRow> hand;                                ///< of a scan by hand: all presses
  std::vector<std::pair<std::string, std::string>> inputs;  ///< name and value, for people
  std::string model;                                        ///< the estimator, with its version; empty: none
  std::optional<fem::Scene> truth;                          ///< of a synthetic block
  std::string made;                                         ///< when, UTC
};

/// Of presses by hand that the window put together.
ScanReport report_of(const SeenScan& scan, const std::string& input);

/// Said on all that is reported of a lump.
inline constexpr const char* kNotice = "For research use. This is not a diagnosis.";

/// Tables for people.
std::string scan_text(const ScanReport& report);
json::Value scan_json(const ScanReport& report);

/// Writes the observation (lump_maps.h), disagreement_Pa.npy, map.csv, presses.csv, outline.csv
/// (of two bumps also outline_2.csv; by hand also hand.csv), scan.json, the plots map and profile (PNG and
/// SVG) and report.html, which needs nothing else. Returns their names in words.
std::string write_scan(const ScanReport& report, const std::filesystem::path& folder);

}  // namespace palpate

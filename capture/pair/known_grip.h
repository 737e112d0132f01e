// What is known of a gripper: where its pads are, and its opening over time.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "engine/grip/geometry.h"
#include "palpate/touch.h"

namespace palpate {

inline constexpr const char* kOpeningLog = "opening.csv";

/// Opening of a gripper over time.
class OpeningSeries {
 public:
  OpeningSeries() = default;
  /// Reads the log, if there is one. Its times are seconds since the first row of pairs.csv and rise. Throws
  /// Error(Failure::Input).
  explicit OpeningSeries(const OpeningSource& source);
  /// Times rise; standard error 0.
  OpeningSeries(std::vector<double> times_s, std::vector<double> openings_mm)
      : times_s_(std::move(times_s)), openings_mm_(std::move(openings_mm)) {}

  /// Between two lines of the log on the straight way; not calibrated where it is not known.
  Estimate at(double time_s) const;
  /// The same, its times counted from `time_s`.
  OpeningSeries from(double time_s) const;
  /// False: the same all the time, or not known.
  bool changes() const { return !times_s_.empty(); }
  /// The columns time_s and opening_mm, with all digits. Throws Error(Failure::Output).
  void write(const std::filesystem::path& file) const;

 private:
  std::optional<double> fixed_mm_;
  double sd_mm_ = 0;
  std::vector<double> times_s_, openings_mm_;
};

struct KnownGrip {
  GripFile file;
  OpeningSeries opening;

  KnownGrip from(double time_s) const { return {file, opening.from(time_s)}; }
  /// Writes the opening into the folder of a pair, where it changes. Returns what pair.json there says.
  GripFile keep(const std::filesystem::path& folder) const;
};

/// Of a grip.json as it was read, with its log. Throws Error(Failure::Input).
KnownGrip known_grip(const GripFile& file);
/// Of two fingers of one simulated grip (left, right, as open_source takes them): the poses of that scene's
/// pads, and the opening from its truth. None: other inputs.
std::optional<KnownGrip> simulated_grip(const std::string& left, const std::string& right);

}  // namespace palpate

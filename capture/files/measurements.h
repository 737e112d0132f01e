// measurements.csv: one row a frame, whole as soon as it is written; contacts.csv: one a contact and frame.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "capture/files/output_file.h"
#include "capture/truth.h"
#include "palpate/touch.h"

namespace palpate {

/// Writes the rows. Units end the columns' names; a cell without meaning (no contact, not calibrated, not
/// asked for) is empty.
class Measurements {
 public:
  struct Columns {
    uint32_t outputs = 0;  ///< as in PipelineOptions: columns of what was not computed stay empty
    bool truth = false;    ///< columns true_* follow
    bool time = true;      ///< false: times are unknown (images without a rate), time_s stays empty
    bool source = false;   ///< column source: the file of each frame
    bool scaled = true;    ///< false: lengths of a contact in px, no area in mm2
  };
  /// Throws Error(Failure::Output), as every member.
  Measurements(const std::filesystem::path& file, const Columns& columns);

  /// `depth_rms_error_mm`: RMS difference between the measured and the true depth map, where it was computed.
  /// `source`: as Source::frame_name.
  void add(const Touch& touch, const Truth* truth, std::optional<double> depth_rms_error_mm = std::nullopt,
           const std::string& source = {});
  void close() { file_.close(); }

  /// The header line of such a file.
  static std::string header(bool truth, bool source = false, bool scaled = true);
  /// The cells of the measurements, without frame, time and truth; and their names. Where several contacts
  /// touch, centroid, ellipse and shift stay empty: they are each contact's.
  static std::string cells(const Touch& touch, uint32_t outputs, bool scaled = true);
  static std::string cell_names(bool scaled = true);

 private:
  LineFile file_;
  Columns columns_;
};

/// Writes contacts.csv (Output::Contacts): columns named and meant as those of measurements.csv, of one
/// contact each; no row in a frame without contact.
class ContactRows {
 public:
  /// `time`, `source`, `scaled`: as Measurements::Columns. Throws Error(Failure::Output), as every member.
  ContactRows(const std::filesystem::path& file, bool time, bool source = false, bool scaled = true);

  void add(const Touch& touch, const std::string& source = {});
  void close() { file_.close(); }
  static std::string header(bool source = false, bool scaled = true);

 private:
  LineFile file_;
  bool time_, source_, scaled_;
};

/// The shortest text that reads back as the same number.
std::string shortest(double value);
/// True where an estimate has a number to show (calibrated, and something touches).
bool has_value(const Estimate& estimate);

}  // namespace palpate

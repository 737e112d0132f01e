// measurements.csv: one row a frame, whole as soon as it is written; contacts.csv: one a contact and frame;
// the same as lines of JSON.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "capture/files/output_file.h"
#include "capture/truth.h"
#include "engine/grip/grip_quantities.h"
#include "engine/measure/quantities.h"
#include "palpate/options.h"
#include "palpate/touch.h"

namespace palpate {

/// Numbers in a table: with all digits, or with those that they deserve. These are two of a standard error
/// and as many places of its value; otherwise a tenth of a micrometre, of a hundredth of a pixel, of a
/// milliradian and of a millinewton.
enum class Digits : uint8_t { All, Deserved };

/// Writes the rows. Units end the columns' names; a cell without meaning (no contact, not calibrated) is
/// empty.
class Measurements {
 public:
  /// Throws Error(Failure::Output), as every member.
  Measurements(const std::filesystem::path& file, MeasuredColumns columns, Digits digits = Digits::Deserved);

  /// `depth_rms_error_mm`: RMS difference between the measured and the true depth map, where it was computed.
  /// `source`: as Source::frame_name.
  void add(const Touch& touch, const Truth* truth, std::optional<double> depth_rms_error_mm = std::nullopt,
           const std::string& source = {});
  void close() { file_.close(); }

  /// The header line of such a file.
  static std::string header(MeasuredColumns columns);
  /// A row of such a file.
  static std::string row(const Touch& touch, MeasuredColumns columns, Digits digits,
                         const Truth* truth = nullptr,
                         std::optional<double> depth_rms_error_mm = std::nullopt,
                         const std::string& source = {});
  /// All cells of the measurements, without frame and time, with all digits; and their names. Where several
  /// contacts touch, centroid, ellipse and shift stay empty: they are each contact's.
  static std::string cells(const Touch& touch, Outputs outputs);
  static std::string cell_names();

 private:
  LineFile file_;
  MeasuredColumns columns_;
  Digits digits_;
};

/// Writes contacts.csv (Output::Contacts): columns named and meant as those of measurements.csv, of one
/// contact each; no row in a frame without contact.
class ContactRows {
 public:
  /// Throws Error(Failure::Output), as every member.
  ContactRows(const std::filesystem::path& file, MeasuredColumns columns, Digits digits = Digits::Deserved);

  void add(const Touch& touch, const std::string& source = {});
  void close() { file_.close(); }
  static std::string header(MeasuredColumns columns);

 private:
  LineFile file_;
  MeasuredColumns columns_;
  Digits digits_;
};

/// A frame as one line of JSON, keys as the columns; cells without meaning are left out. `contacts` is the
/// list of the separate contacts, in a frame where they are separated. Ends without a line end.
std::string json_line(const Touch& touch, MeasuredColumns columns, Digits digits = Digits::Deserved,
                      const Truth* truth = nullptr, std::optional<double> depth_rms_error_mm = std::nullopt,
                      const std::string& source = {});

/// Header and rows of pairs.csv: the frames of two fingers and what both hold, as Measurements writes them.
std::string grip_header();
std::string grip_row(const GripFrame& frame, Digits digits = Digits::Deserved);
/// The same as one line of JSON, as json_line.
std::string grip_json_line(const GripFrame& frame, Digits digits = Digits::Deserved);

/// The shortest text that reads back as the same number.
std::string shortest(double value);
/// `value` with so many places; never a negative zero.
std::string with_places(double value, int places);
/// Places of a value whose standard error is `error`: two digits of the error.
int deserved_places(double error);

}  // namespace palpate

// Error: one line that says what was wanted, what was found, what to try.
#pragma once

#include <cstddef>
#include <stdexcept>
#include <string>
#include <string_view>

#include "palpate/export.h"

namespace palpate {

/// Why the program gives up. The value is the exit code, documented in viz/commands/README.md.
enum class Failure : int {
  Usage = 2,    ///< the command line makes no sense
  Input = 3,    ///< a recording, image or array is missing, unreadable or malformed
  Sensor = 4,   ///< a sensor file is missing, malformed or out of range
  Device = 5,   ///< no usable Vulkan device or camera, or it failed
  Display = 6,  ///< a window was asked for and there is no display
  Output = 7,   ///< results cannot be written (permissions, full disk)
};

/// One clear line for the person at the keyboard: "wanted ...; found ...; try ...". Its three parts are views
/// into what(), valid as long as the error is.
class PALPATE_API Error : public std::runtime_error {
 public:
  Error(Failure failure, const std::string& wanted, const std::string& found, const std::string& remedy)
      : std::runtime_error("wanted " + wanted + "; found " + found + "; try " + remedy),
        failure_(failure),
        wanted_(wanted.size()),
        found_(found.size()),
        remedy_(remedy.size()) {}

  Failure failure() const { return failure_; }
  int exit_code() const { return static_cast<int>(failure_); }
  std::string_view wanted() const { return {what() + kWanted.size(), wanted_}; }
  std::string_view found() const { return {wanted().data() + wanted_ + kFound.size(), found_}; }
  std::string_view remedy() const { return {found().data() + found_ + kTry.size(), remedy_}; }

 private:
  static constexpr std::string_view kWanted = "wanted ", kFound = "; found ", kTry = "; try ";
  Failure failure_;
  size_t wanted_, found_, remedy_;  // lengths: a copy of the error allocates nothing
};

}  // namespace palpate

// Error: one line that says what was wanted, what was found, what to try.
#pragma once

#include <stdexcept>
#include <string>

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

/// One clear line for the person at the keyboard: "wanted ...; found ...; try ...".
class PALPATE_API Error : public std::runtime_error {
 public:
  Error(Failure failure, const std::string& wanted, const std::string& found, const std::string& remedy)
      : std::runtime_error("wanted " + wanted + "; found " + found + "; try " + remedy), failure_(failure) {}

  Failure failure() const { return failure_; }
  int exit_code() const { return static_cast<int>(failure_); }

 private:
  Failure failure_;
};

}  // namespace palpate

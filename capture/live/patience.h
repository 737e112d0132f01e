// How long a source that gives no frames is waited for.
#pragma once

#include <chrono>
#include <limits>
#include <optional>
#include <string>

#include "capture/source.h"
#include "palpate/error.h"

namespace palpate {

class Patience {
 public:
  /// `input`: as the source was opened, for error().
  explicit Patience(double seconds = std::numeric_limits<double>::infinity(), std::string input = {})
      : seconds_(seconds), input_(std::move(input)) {}

  /// Asked again and again by the thread that waits for a frame: whether the source has been gone or silent
  /// too long.
  bool over(const Source& source);
  /// Error that then ends the run.
  Error error() const;

 private:
  double seconds_;
  std::string input_;
  std::string state_;
  std::optional<std::chrono::steady_clock::time_point> silent_since_;
};

}  // namespace palpate

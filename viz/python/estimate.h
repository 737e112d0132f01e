// Estimates as Python sees them: a number with its standard error, state and unit.
#pragma once

#include <pybind11/pybind11.h>

#include <string>

#include "palpate/touch.h"

namespace palpate::python {

struct Measured {
  double value = 0;  ///< NaN: there is none
  double sd = 0;     ///< NaN: not stated
  std::string state;
  std::string unit;

  bool valid() const { return state == "valid"; }
  /// The number that comparisons and float() see: NaN unless valid.
  double number() const;
  /// "0.84 ± 0.01 N", with the state behind where it is not valid.
  std::string text() const;
};

Measured measured(const Estimate& estimate, const char* unit);
Measured measured(double value, double sd, Validity validity, const char* unit);

}  // namespace palpate::python

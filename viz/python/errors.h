// Errors as Python sees them: palpate.Error and its subclasses, with what was wanted, what was found and what
// to try.
#pragma once

#include <pybind11/pybind11.h>

#include <string>

namespace palpate::python {

/// An error of the module's own: `type` is a class of palpate/_errors.py.
struct Refusal {
  const char* type;
  std::string wanted, found, remedy;
};

/// An argument that makes no sense.
inline Refusal bad_argument(std::string wanted, std::string found, std::string remedy) {
  return {"ArgumentError", std::move(wanted), std::move(found), std::move(remedy)};
}

}  // namespace palpate::python

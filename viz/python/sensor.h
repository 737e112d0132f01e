// Sensor files, and the input that a caller names.
#pragma once

#include <pybind11/pybind11.h>

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "capture/run/run_settings.h"
#include "engine/base/text.h"
#include "viz/python/errors.h"

namespace palpate::python {

SurfaceSolver solver_of(const std::string& name);

/// The value of a name in a table of names; others are refused with the list.
template <typename Value>
Value by_name(const std::map<std::string, Value>& all, const std::string& name, const char* what) {
  const auto found = all.find(name);
  if (found != all.end()) return found->second;
  std::vector<std::string> names;
  std::string list;
  for (const auto& [known, value] : all) {
    names.push_back(known);
    list += (list.empty() ? "" : ", ") + known;
  }
  throw bad_argument(what, "'" + name + "'" + did_you_mean(name, names), list);
}

}  // namespace palpate::python

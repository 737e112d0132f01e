// Profiles of machines: their files and their comparison. Measuring one is the program's work.
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include "perf/profile/profile.h"
#include "perf/profile/report/compare.h"
#include "perf/profile/report/tables.h"
#include "viz/python/bindings.h"

namespace palpate::python {
namespace {

namespace py = pybind11;

/// The text of a checked profile, and its tables for a person.
py::tuple load(const std::filesystem::path& file) {
  const perf::Profile profile = perf::load_profile(file);
  std::string tables;
  for (const perf::Table& table : perf::tables_of(profile)) tables += perf::to_text(table) + "\n";
  return py::make_tuple(perf::file_text(profile), tables);
}

py::tuple compare(const std::vector<std::string>& texts) {
  std::vector<perf::Profile> profiles;
  for (const std::string& text : texts) profiles.push_back(perf::parse_profile(text, "profile"));
  const perf::MachineComparison comparison = perf::compare_profiles(profiles);
  return py::make_tuple(perf::to_json(comparison).dump(1, json::Utf8::Replace), perf::describe(comparison));
}

}  // namespace

void bind_profile(py::module_& module) {
  bind_function(module, "profile_load", &load, "file");
  bind_function(module, "profile_compare", &compare, "texts");
}

}  // namespace palpate::python

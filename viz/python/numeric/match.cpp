#include <pybind11/stl.h>

#include "engine/numeric/matching/matching.h"
#include "viz/python/arrays.h"
#include "viz/python/bindings.h"
#include "viz/python/waiting.h"

namespace palpate::python {
namespace {

PointSet points_of(const py::object& given, const char* name) {
  Shape shape;
  PointSet set;
  set.coordinates = numbers_of<double>(given, name, 2, "points x 2 or points x 3", shape);
  if (shape[1] != 2 && shape[1] != 3)
    throw bad_argument(std::string(name) + " of points x 2 or points x 3", "shape " + shape_text(shape),
                       "one point a row");
  set.axes = static_cast<uint32_t>(shape[1]);
  return set;
}

py::dict match(const py::object& given_from, const py::object& given_to, bool reflections,
               double most_turn_deg) {
  PointSet from = points_of(given_from, "rest"), to = points_of(given_to, "pressed");
  const Shape shape = {static_cast<py::ssize_t>(from.size()), static_cast<py::ssize_t>(from.axes)};
  MatchOptions options;
  options.reflections = reflections;
  options.most_turn_deg = most_turn_deg;
  MatchResult result = run_apart([from = std::move(from), to = std::move(to), options](
                                     const std::atomic<bool>&) { return match_points(from, to, options); });
  py::dict d;
  d["reliable"] = result.reliable();
  d["verdict"] = std::string(to_string(result.verdict));
  d["partner"] = column(result.partners,
                        [](const Partner& p) { return p.target ? static_cast<int64_t>(*p.target) : -1; });
  d["probability"] = column(result.partners, &Partner::probability);
  d["warped"] = hand_out(std::move(result.warped.coordinates), shape);
  d["noise_sd"] = result.noise_sd;
  d["posterior"] = result.posterior;
  d["target_outlier_fraction"] = result.target_outlier_fraction;
  d["template_nil_fraction"] = result.template_nil_fraction;
  d["converged"] = result.converged;
  return d;
}

}  // namespace

void bind_match(py::module_& module) {
  bind_function(module, "match", &match, "rest pressed reflections most_turn_deg");
}

}  // namespace palpate::python

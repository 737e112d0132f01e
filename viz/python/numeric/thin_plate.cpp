#include <pybind11/stl.h>

#include <memory>
#include <mutex>
#include <variant>

#include "engine/base/text.h"
#include "engine/measure/strain.h"
#include "engine/numeric/thin_plate/thin_plate.h"
#include "viz/python/arrays.h"
#include "viz/python/bindings.h"
#include "viz/python/waiting.h"

namespace palpate::python {
namespace {

template <size_t D>
std::vector<std::array<double, D>> places_of(const std::vector<double>& numbers) {
  std::vector<std::array<double, D>> places(numbers.size() / D);
  for (size_t i = 0; i < numbers.size(); ++i) places[i / D][i % D] = numbers[i];
  return places;
}

/// Points x 2 or points x 3.
std::vector<double> points_of(const py::object& given, const char* name, size_t axes, Shape& shape) {
  std::vector<double> points = numbers_of<double>(
      given, name, 2, axes ? (axes == 2 ? "points x 2" : "points x 3") : "points x 2 or points x 3", shape);
  const auto found = static_cast<size_t>(shape[1]);
  if (axes ? found != axes : found != 2 && found != 3)
    throw bad_argument(std::string(name) + " of points x " + (axes ? std::to_string(axes) : "2 or 3"),
                       "shape " + shape_text(shape), "one point a row");
  return points;
}

/// A fitted spline.
class PyFit {
 public:
  using Spline = std::variant<ThinPlateSpline<2>, ThinPlateSpline<3>>;
  PyFit(Spline spline, bool scalar) : spline_(std::move(spline)), scalar_(scalar) {}

  size_t axes() const { return spline_.index() + 2; }
  const PlateStatistics& statistics() const {
    return std::visit([](const auto& s) -> const PlateStatistics& { return s.statistics(); }, spline_);
  }

  py::object values(const py::object& xy) const { return evaluated(xy, 0); }
  py::object gradient(const py::object& xy) const { return evaluated(xy, 1); }

  py::dict strain(const py::object& xy) const {
    const auto* plane = std::get_if<ThinPlateSpline<2>>(&spline_);
    if (!plane || plane->fields() != 2)
      throw bad_argument("a fit of two shifts over points of the plane", "another one",
                         "ThinPlate(points x 2).fit(shifts x 2)");
    Shape shape;
    const auto places = places_of<2>(points_of(xy, "xy", 2, shape));
    std::vector<double> first(4 * places.size());
    {
      const py::gil_scoped_release release;
      plane->evaluate(places, {}, first);
    }
    std::vector<PlaneStrain> strains;
    for (size_t i = 0; i < places.size(); ++i)
      strains.push_back(plane_strain({first[4 * i], first[4 * i + 1], first[4 * i + 2], first[4 * i + 3]}));
    py::dict d;
    d["xx"] = column(strains, &PlaneStrain::xx);
    d["yy"] = column(strains, &PlaneStrain::yy);
    d["xy"] = column(strains, &PlaneStrain::xy);
    d["first"] = column(strains, &PlaneStrain::first);
    d["second"] = column(strains, &PlaneStrain::second);
    d["direction_rad"] = column(strains, &PlaneStrain::direction_rad);
    d["shear"] = column(strains, &PlaneStrain::shear);
    d["area"] = column(strains, &PlaneStrain::area);
    return d;
  }

 private:
  /// Values, or first derivatives: places x fields (x axes), without the fields' axis where one was fitted.
  py::object evaluated(const py::object& xy, int order) const {
    return std::visit(
        [&]<size_t D>(const ThinPlateSpline<D>& spline) -> py::object {
          Shape shape;
          const auto places = places_of<D>(points_of(xy, "xy", D, shape));
          const size_t fields = spline.fields();
          std::vector<double> values(order == 0 ? places.size() * fields : 0),
              first(order == 1 ? places.size() * fields * D : 0);
          {
            const py::gil_scoped_release release;
            spline.evaluate(places, values, first);
          }
          Shape answer = {shape[0]};
          if (!scalar_) answer.push_back(static_cast<py::ssize_t>(fields));
          if (order == 1) answer.push_back(D);
          return hand_out(std::move(order == 1 ? first : values), answer);
        },
        spline_);
  }

  Spline spline_;
  bool scalar_;
};

/// Points, factored once.
class PyThinPlate {
 public:
  PyThinPlate(const py::object& given, const py::object& given_weights, const std::string& kernel) {
    PlateOptions options;
    if (kernel == "log")
      options.kernel = PlateKernel::Log;
    else if (kernel == "linear")
      options.kernel = PlateKernel::Linear;
    else if (kernel == "cubic")
      options.kernel = PlateKernel::Cubic;
    else if (!kernel.empty())
      throw bad_argument("a kernel: log, linear or cubic", "'" + kernel + "'",
                         "none, for the thin plate's own");
    Shape shape, other;
    const std::vector<double> points = points_of(given, "points", 0, shape);
    std::vector<double> weights;
    if (!given_weights.is_none())
      weights = numbers_of<double>(given_weights, "weights", 1, "one number a point", other);
    axes_ = static_cast<size_t>(shape[1]);
    plate_ = run_apart([=, axes = axes_](const std::atomic<bool>&) {
      auto shared = std::make_shared<Shared>();
      if (axes == 2)
        shared->plate.emplace<ThinPlate<2>>(std::span<const std::array<double, 2>>(places_of<2>(points)),
                                            options, weights);
      else
        shared->plate.emplace<ThinPlate<3>>(std::span<const std::array<double, 3>>(places_of<3>(points)),
                                            options, weights);
      return shared;
    });
    points_ = shape[0];
  }

  PyFit fit(const py::object& given, std::optional<double> lambda) {
    Shape shape;
    std::vector<double> values = numbers<double>(given, "values", shape);
    if ((shape.size() != 1 && shape.size() != 2) || shape[0] != points_)
      throw bad_argument("values of " + std::to_string(points_) + " points, or of points x fields",
                         "shape " + shape_text(shape), "one row a point");
    if (lambda && !(*lambda >= 0))
      throw bad_argument("lam of at least 0", std::to_string(*lambda), "None, which chooses by the data");
    const bool scalar = shape.size() == 1;
    const size_t fields = scalar ? 1 : static_cast<size_t>(shape[1]);
    if (fields == 0) throw bad_argument("a field to fit", "shape " + shape_text(shape), "one column a field");
    return run_apart(
        [plate = plate_, values = std::move(values), fields, lambda, scalar](const std::atomic<bool>&) {
          const std::lock_guard lock(plate->mutex);
          if (auto* plane = std::get_if<ThinPlate<2>>(&plate->plate))
            return PyFit(plane->fit(values, fields, lambda), scalar);
          return PyFit(std::get<ThinPlate<3>>(plate->plate).fit(values, fields, lambda), scalar);
        });
  }

  py::ssize_t points() const { return points_; }
  size_t axes() const { return axes_; }

 private:
  /// A fit may factor another lambda: one at a time.
  struct Shared {
    std::mutex mutex;
    std::variant<std::monostate, ThinPlate<2>, ThinPlate<3>> plate;
  };
  std::shared_ptr<Shared> plate_;
  py::ssize_t points_ = 0;
  size_t axes_ = 2;
};

}  // namespace

void bind_thin_plate(py::module_& module) {
  py::class_<PyFit> fit(module, "PlateFit");
  fit.def("__call__", &PyFit::values, py::arg("xy"))
      .def("gradient", &PyFit::gradient, py::arg("xy"))
      .def("_strain", &PyFit::strain, py::arg("xy"))
      .def("__repr__", [](const PyFit& f) {
        return text("<palpate.PlateFit lam %.3g over %zu points>", f.statistics().lambda,
                    f.statistics().points);
      });
  const auto number = [&fit](const char* name, auto member) {
    fit.def_property_readonly(name, [member](const PyFit& f) { return f.statistics().*member; });
  };
  number("lam", &PlateStatistics::lambda);
  number("lam_by_data", &PlateStatistics::lambda_by_data);
  number("lam_raised", &PlateStatistics::lambda_raised);
  number("freedom", &PlateStatistics::freedom);
  number("condition", &PlateStatistics::condition);
  number("merged", &PlateStatistics::merged);
  number("rank", &PlateStatistics::rank);
  fit.def_property_readonly("residual_sd",
                            [](const PyFit& f) { return hand_out(f.statistics().residual_sd); });
  py::class_<PyThinPlate>(module, "ThinPlate")
      .def(py::init<const py::object&, const py::object&, const std::string&>(), py::arg("points"),
           py::arg("weights") = py::none(), py::kw_only(), py::arg("kernel") = "")
      .def("fit", &PyThinPlate::fit, py::arg("values"), py::arg("lam") = py::none())
      .def("__len__", &PyThinPlate::points)
      .def("__repr__", [](const PyThinPlate& p) {
        return text("<palpate.ThinPlate %lld points of %zu axes>", static_cast<long long>(p.points()),
                    p.axes());
      });
}

}  // namespace palpate::python

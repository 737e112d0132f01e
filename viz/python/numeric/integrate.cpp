#include <pybind11/stl.h>

#include <cmath>

#include "engine/stages/surface/surface.h"
#include "engine/stages/surface/weighted_surface.h"
#include "viz/python/arrays.h"
#include "viz/python/bindings.h"
#include "viz/python/device.h"
#include "viz/python/sensor.h"
#include "viz/python/waiting.h"

namespace palpate::python {
namespace {

void check_sides(const Shape& shape) {
  for (const py::ssize_t side : shape)
    if (side < 1 || side > static_cast<py::ssize_t>(kMaxSide_px))
      throw bad_argument("sides of 1 to " + std::to_string(kMaxSide_px), "shape " + shape_text(shape),
                         "a part of the field");
}

/// rows x columns x 2. Where a weight is 0 a slope may be anything; it is then taken as 0.
std::vector<float> interleaved(const std::vector<float>& gx, const std::vector<float>& gy,
                               const std::vector<float>& weights, const Shape& shape) {
  std::vector<float> both(2 * gx.size());
  for (size_t i = 0; i < gx.size(); ++i) {
    const bool known = weights.empty() || weights[i] > 0;
    if (known && !(std::isfinite(gx[i]) && std::isfinite(gy[i]))) {
      const auto at = static_cast<py::ssize_t>(i);
      throw bad_argument("finite slopes, or weight 0 where they are not known",
                         std::string(std::isnan(gx[i] + gy[i]) ? "NaN" : "infinity") + " at index " +
                             shape_text({at / shape[1], at % shape[1]}),
                         "weights=numpy.isfinite(gx) & numpy.isfinite(gy)");
    }
    both[2 * i] = known ? gx[i] : 0;
    both[2 * i + 1] = known ? gy[i] : 0;
  }
  return both;
}

struct Answer {
  std::vector<float> height;
  double residual = 0, inconsistency = 0, peak_to_valley = 0;
  uint32_t islands = 1, iterations = 0;
  uint64_t unknown_px = 0, kinks = 0;
  bool converged = true;
};

py::dict integrate(const py::object& given_x, const py::object& given_y, const py::object& given_weights,
                   const std::string& solver, bool kinks, const std::string& device) {
  Shape shape, other;
  const std::vector<float> gx = numbers_of<float>(given_x, "gx", 2, "rows x columns", shape, Finite::Free);
  const std::vector<float> gy = numbers_of<float>(given_y, "gy", 2, "rows x columns", other, Finite::Free);
  if (shape != other)
    throw bad_argument("gx and gy of one shape", shape_text(shape) + " and " + shape_text(other),
                       "both of rows x columns");
  check_sides(shape);
  std::vector<float> weights;
  const bool weighted = !given_weights.is_none() || kinks;
  if (given_weights.is_none()) {
    if (kinks) weights.assign(gx.size(), 1.0f);
  } else {
    const bool mask = py::isinstance<py::array>(given_weights) &&
                      py::reinterpret_borrow<py::array>(given_weights).dtype().kind() == 'b';
    weights = numbers_of<float>(mask ? given_weights.attr("astype")("float32") : given_weights, "weights", 2,
                                "rows x columns", other);
    if (shape != other)
      throw bad_argument("weights of the shape of gx, " + shape_text(shape), shape_text(other),
                         "a weight for each pixel");
    for (const float w : weights)
      if (w < 0) throw bad_argument("weights of at least 0", std::to_string(w), "0 for what is not known");
  }
  std::vector<float> slopes = interleaved(gx, gy, weights, shape);
  const auto rows = static_cast<uint32_t>(shape[0]), columns = static_cast<uint32_t>(shape[1]);
  const SurfaceSolver how = solver_of(solver);
  Answer a =
      run_apart([=, slopes = std::move(slopes), weights = std::move(weights)](const std::atomic<bool>&) {
        const std::shared_ptr<gpu::Context> context = shared_device(device);
        Answer answer;
        if (!weighted) {
          Heights heights = integrate_gradients(*context, slopes, rows, columns, how);
          answer.height = std::move(heights.values);
          answer.residual = heights.statistics.residual;
          answer.inconsistency = heights.statistics.inconsistency;
          answer.peak_to_valley = heights.statistics.peak_to_valley;
          return answer;
        }
        WeightedHeights heights = integrate_weighted(*context, slopes, weights, rows, columns, how, kinks);
        answer.height = std::move(heights.values);
        answer.residual = heights.statistics.residual;
        answer.inconsistency = heights.statistics.unexplained;
        answer.peak_to_valley = heights.peak_to_valley;
        answer.islands = heights.islands.count;
        answer.unknown_px = heights.islands.unknown_px;
        answer.iterations = heights.statistics.iterations;
        answer.converged = heights.statistics.converged;
        answer.kinks = heights.kinks;
        return answer;
      });
  py::dict d;
  d["height"] = hand_out(std::move(a.height), shape);
  d["residual"] = a.residual;
  d["inconsistency"] = a.inconsistency;
  d["peak_to_valley"] = a.peak_to_valley;
  d["islands"] = a.islands;
  d["unknown_px"] = a.unknown_px;
  d["kinks"] = a.kinks;
  d["iterations"] = a.iterations;
  d["converged"] = a.converged;
  return d;
}

}  // namespace

void bind_integrate(py::module_& module) {
  bind_function(module, "integrate", &integrate, "gx gy weights solver kinks device");
}

}  // namespace palpate::python

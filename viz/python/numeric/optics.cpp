#include <pybind11/stl.h>

#include <numbers>

#include "engine/optics/optical_stack.h"
#include "viz/python/arrays.h"
#include "viz/python/bindings.h"

namespace palpate::python {
namespace {

/// Light of a stack at each angle, for s, p and unpolarised light.
py::dict stack(const std::vector<double>& indices, const std::vector<double>& extinction,
               const std::vector<double>& thickness_mm, const py::object& given_angles,
               double wavelength_nm) {
  Shape shape;
  const std::vector<double> angles = numbers<double>(given_angles, "angle_deg", shape);
  const size_t layers = indices.size() < 2 ? 0 : indices.size() - 2;
  if (indices.size() < 2)
    throw bad_argument("two indices or more: from, layers, to", std::to_string(indices.size()),
                       "[1, 1.4, 1]");
  if (!extinction.empty() && extinction.size() != indices.size())
    throw bad_argument("an extinction for each index", std::to_string(extinction.size()),
                       "0 for what is clear");
  if (thickness_mm.size() != layers)
    throw bad_argument("a thickness for each of " + std::to_string(layers) + " layers",
                       std::to_string(thickness_mm.size()), "one number for all");
  const auto index = [&](size_t i) {
    return optics::optical_index(indices[i], extinction.empty() ? 0 : extinction[i]);
  };
  optics::OpticalStack media;
  media.from = index(0);
  media.to = index(indices.size() - 1);
  media.wavelength_nm = wavelength_nm;
  for (size_t i = 0; i < layers; ++i) media.layers.push_back({index(i + 1), thickness_mm[i]});
  // Three rows: s, p, unpolarised.
  const size_t count = angles.size();
  std::vector<double> reflected(3 * count), passed(3 * count), absorbed(3 * count), each(3 * count * layers);
  {
    const py::gil_scoped_release release;
    for (size_t i = 0; i < count; ++i) {
      // 90 deg is a half turn's half to the last bit.
      const double angle = angles[i] == 90 ? std::numbers::pi / 2 : angles[i] * std::numbers::pi / 180;
      const optics::StackLight lights[3] = {optics::stack_light(media, angle, optics::Polarisation::S),
                                            optics::stack_light(media, angle, optics::Polarisation::P),
                                            optics::unpolarised_light(media, angle)};
      for (size_t k = 0; k < 3; ++k) {
        reflected[k * count + i] = lights[k].reflectance;
        passed[k * count + i] = lights[k].transmittance;
        absorbed[k * count + i] = lights[k].absorbed();
        for (size_t l = 0; l < layers; ++l) each[(k * count + i) * layers + l] = lights[k].absorptance[l];
      }
    }
  }
  shape.insert(shape.begin(), 3);
  Shape with_layers = shape;
  with_layers.push_back(static_cast<py::ssize_t>(layers));
  py::dict d;
  d["reflectance"] = hand_out(std::move(reflected), shape);
  d["transmittance"] = hand_out(std::move(passed), shape);
  d["absorptance"] = hand_out(std::move(absorbed), shape);
  d["layer_absorptance"] = hand_out(std::move(each), with_layers);
  return d;
}

}  // namespace

void bind_optics(py::module_& module) {
  bind_function(module, "optics_stack", &stack, "indices extinction thickness_mm angle_deg wavelength_nm");
}

}  // namespace palpate::python

// Contact of an indenter with a pad, and finite elements of a pressed block.
#include <pybind11/stl.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "engine/elasticity/hertz.h"
#include "engine/elasticity/modulus/indentation.h"
#include "engine/fem/solve.h"
#include "viz/python/arrays.h"
#include "viz/python/bindings.h"
#include "viz/python/device.h"
#include "viz/python/sensor.h"
#include "viz/python/waiting.h"

namespace palpate::python {
namespace {

const std::map<std::string, IndenterShape> kIndenters = {{"sphere", IndenterShape::Sphere},
                                                         {"paraboloid", IndenterShape::Paraboloid},
                                                         {"cone", IndenterShape::Cone},
                                                         {"flat", IndenterShape::FlatPunch}};

Pad pad_of(std::vector<double> young_MPa, double poisson, const std::vector<double>& thickness_mm,
           const std::string& series, bool sliding) {
  if (young_MPa.empty()) throw bad_argument("young_kPa of the pad", "none", "young_kPa=60");
  if (!thickness_mm.empty() && thickness_mm.size() != young_MPa.size())
    throw bad_argument("one thickness_mm for each of young_kPa",
                       std::to_string(young_MPa.size()) + " moduli and " +
                           std::to_string(thickness_mm.size()) + " thicknesses",
                       "lists of equal length");
  if (series != "thickness" && series != "paper")
    throw bad_argument("series 'thickness' or 'paper'", "'" + series + "'", "series=\"thickness\"");
  const bool paper = series == "paper";
  if (young_MPa.size() > 1 && thickness_mm.empty() && !paper)
    throw bad_argument("thickness_mm of each layer", "none", "thickness_mm=[2, 2, 2], or series=\"paper\"");
  for (double& young : young_MPa) young *= 1e-3;
  return layered_pad(young_MPa, poisson, thickness_mm, paper, sliding ? Base::Frictionless : Base::Bonded);
}

py::dict contact(std::optional<double> force_N, std::optional<double> depth_mm,
                 const std::vector<double>& young_kPa, double poisson,
                 const std::vector<double>& thickness_mm, const std::string& series, const std::string& shape,
                 double radius_mm, std::optional<double> radius2_mm, double half_angle_deg,
                 std::optional<double> indenter_young_MPa, double indenter_poisson, bool sliding) {
  if (force_N.has_value() == depth_mm.has_value())
    throw bad_argument("force_N or depth_mm", force_N ? "both" : "neither", "force_N=0.5");
  const Pad pad = pad_of(young_kPa, poisson, thickness_mm, series, sliding);
  Indenter indenter;
  indenter.shape = by_name(kIndenters, shape, "a shape");
  indenter.radius_mm = radius2_mm ? effective_radius_mm(radius_mm, *radius2_mm) : radius_mm;
  indenter.half_angle_rad = half_angle_deg * std::numbers::pi / 180;
  if (indenter_young_MPa) indenter.material = {*indenter_young_MPa, indenter_poisson};
  const PadIndenter exact(pad, indenter);
  const Indentation found = force_N ? exact.at_force(*force_N) : exact.at_depth(*depth_mm);
  const HertzErrors errors = hertz_errors(pad, indenter, found);
  py::dict d;
  d["force_N"] = found.force_N;
  d["depth_mm"] = found.depth_mm;
  d["radius_mm"] = found.radius_mm;
  d["pressure_max_kPa"] = 1e3 * found.pressure_max_MPa;
  d["hertz_error"] = errors.together;
  d["strain"] = errors.strain;
  d["young_kPa"] = 1e3 * pad.material.young_MPa;
  // From the axis to beyond the rim.
  constexpr int kSteps = 220;
  std::vector<double> r_mm(kSteps + 1), pressure_kPa(kSteps + 1);
  for (int i = 0; i <= kSteps; ++i) {
    r_mm[i] = 1.1 * found.radius_mm * i / kSteps;
    pressure_kPa[i] = 1e3 * exact.pressure_MPa(found, r_mm[i]);
  }
  d["r_mm"] = hand_out(std::move(r_mm));
  d["pressure_kPa"] = hand_out(std::move(pressure_kPa));
  return d;
}

struct Asked {
  fem::Scene scene;
  bool large_strain = false;
  uint32_t threads = 0;
};

const std::map<std::string, InclusionShape> kInclusions = {{"sphere", InclusionShape::Sphere},
                                                           {"ellipsoid", InclusionShape::Ellipsoid},
                                                           {"cylinder", InclusionShape::Cylinder},
                                                           {"lying", InclusionShape::LyingCylinder}};
const std::map<std::string, fem::Presser> kPressers = {
    {"flat", fem::Presser::Flat}, {"sphere", fem::Presser::Sphere}, {"pressure", fem::Presser::Pressure}};

py::object map_of(PressureMap map) {
  const Shape shape = {map.height, map.width};
  return hand_out(std::move(map.values), shape);
}

py::dict forward(const std::array<double, 3>& block_mm, double young_Pa, double poisson,
                 const std::optional<std::string>& lump, const std::array<double, 3>& size_mm,
                 double depth_mm, double ratio, const std::array<double, 2>& offset_mm,
                 const std::string& presser, double ball_radius_mm, std::optional<double> press_mm,
                 std::optional<double> force_N, const std::array<uint32_t, 3>& cells, bool large_strain,
                 uint32_t threads) {
  Asked asked{{}, large_strain, threads};
  fem::Scene& scene = asked.scene;
  scene.block_mm = block_mm;
  scene.young_Pa = young_Pa;
  scene.poisson = poisson;
  scene.inclusion.reset();
  if (lump)
    scene.inclusion =
        fem::Inclusion{by_name(kInclusions, *lump, "a lump's shape"), size_mm, depth_mm, ratio, offset_mm};
  scene.presser = by_name(kPressers, presser, "a presser");
  scene.ball_radius_mm = ball_radius_mm;
  scene.press_mm = press_mm;
  scene.force_N = force_N;
  scene.cells = cells;
  check(scene);
  fem::Result result = run_apart([asked](const std::atomic<bool>&) {
    fem::Options options;
    options.large_strain = asked.large_strain;
    options.threads = asked.threads;
    return fem::solve(asked.scene, options);
  });
  py::dict d;
  d["converged"] = result.converged;
  d["residual"] = result.residual;
  d["force_N"] = result.force_N;
  d["press_mm"] = result.press_mm;
  d["center_stress_Pa"] = result.center_stress_Pa;
  d["contact_radius_mm"] = result.contact_radius_mm;
  d["core_strain"] = result.core_strain;
  d["pitch_mm"] = result.stress_Pa.pitch_mm;
  d["stress_Pa"] = map_of(std::move(result.stress_Pa));
  d["deflection_mm"] = map_of(std::move(result.deflection_mm));
  d["warnings"] = py::tuple(py::cast(result.warnings));
  return d;
}

}  // namespace

void bind_mechanics(py::module_& module) {
  bind_function(
      module, "contact", &contact,
      "force_N depth_mm young_kPa poisson thickness_mm series shape radius_mm radius2_mm half_angle_deg "
      "indenter_young_MPa indenter_poisson sliding");
  bind_function(
      module, "forward", &forward,
      "block_mm young_Pa poisson lump size_mm depth_mm ratio offset_mm presser ball_radius_mm press_mm "
      "force_N cells large_strain threads");
}

}  // namespace palpate::python

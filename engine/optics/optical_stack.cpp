#include "engine/optics/optical_stack.h"

#include <cmath>
#include <numbers>
#include <numeric>
#include <string>

#include "palpate/error.h"

namespace palpate::optics {
namespace {

void check(const OpticalStack& stack, double angle_rad) {
  const auto check_index = [](OpticalIndex index) { optical_index(index.real(), -index.imag()); };
  check_index(stack.from);
  check_index(stack.to);
  if (stack.from.imag() != 0)
    throw Error(Failure::Input, "a first medium that does not absorb",
                "extinction " + std::to_string(-stack.from.imag()), "extinction 0 for that medium");
  for (const OpticalLayer& layer : stack.layers) {
    check_index(layer.index);
    if (!(layer.thickness_mm > 0) || !std::isfinite(layer.thickness_mm))
      throw Error(Failure::Input, "layers thicker than 0 mm", std::to_string(layer.thickness_mm),
                  "the layer's thickness in mm");
  }
  if (!(stack.wavelength_nm > 0) || !std::isfinite(stack.wavelength_nm))
    throw Error(Failure::Input, "a wavelength > 0 nm", std::to_string(stack.wavelength_nm),
                "630 for red light");
  if (!(angle_rad >= 0 && angle_rad <= std::numbers::pi / 2))
    throw Error(Failure::Input, "an angle of incidence from 0 to 90 deg",
                std::to_string(angle_rad * 180 / std::numbers::pi) + " deg", "an angle from the normal");
}

}  // namespace

double StackLight::absorbed() const {
  return std::accumulate(absorptance.begin(), absorptance.end(), 0.0);
}

double tangential_index(const OpticalStack& stack, double angle_rad) {
  check(stack, angle_rad);
  return angle_rad == std::numbers::pi / 2 ? stack.from.real() : stack.from.real() * std::sin(angle_rad);
}

StackLight stack_light(const OpticalStack& stack, double angle_rad, Polarisation polarisation) {
  const double s = tangential_index(stack, angle_rad);
  const size_t count = stack.layers.size();
  // Interface j lies above layer j; the last one above the medium behind.
  std::vector<InterfaceFractions> faces(count + 1);
  std::vector<double> depth(count);  // optical depth of a single pass
  for (size_t j = 0; j <= count; ++j) {
    const OpticalIndex above = j == 0 ? stack.from : stack.layers[j - 1].index;
    const OpticalIndex below = j == count ? stack.to : stack.layers[j].index;
    faces[j] = interface_fractions(above, below, s, polarisation);
    if (j == count || below.imag() == 0) continue;
    const double k0_per_mm = 2 * std::numbers::pi / (stack.wavelength_nm * 1e-6);
    depth[j] = -2 * k0_per_mm * normal_index(below, s).imag() * stack.layers[j].thickness_mm;
  }
  // Upwards: what everything from interface j on reflects, and what it does not, each without cancellation.
  std::vector<double> reflected(count + 1), taken(count + 1), below_fraction(count + 1);
  reflected[count] = faces[count].reflected;
  taken[count] = faces[count].passed;
  for (size_t j = count; j-- > 0;) {
    const InterfaceFractions& face = faces[j];
    const double a2 = std::exp(-2 * depth[j]), lost = -std::expm1(-2 * depth[j]);
    // 1 - a^2 R21 R23
    const double echo = lost + a2 * (face.passed + face.reflected * taken[j + 1]);
    if (face.passed == 0) {
      reflected[j] = 1;
      taken[j] = 0;
      continue;
    }
    below_fraction[j] = face.passed / echo;  // light below the interface, going down, per light that arrives
    taken[j] = below_fraction[j] * (lost + a2 * taken[j + 1]);
    reflected[j] = taken[j] < 0.5 ? 1 - taken[j]
                                  : face.reflected + below_fraction[j] * a2 * reflected[j + 1] * face.passed;
  }
  // Downwards: how much light there is in each layer, and so what each takes.
  StackLight light;
  light.reflectance = reflected[0];
  light.absorptance.resize(count);
  double arriving = 1;
  for (size_t j = 0; j < count; ++j) {
    const double down = arriving * below_fraction[j], a = std::exp(-depth[j]);
    light.absorptance[j] = down * -std::expm1(-depth[j]) * (1 + a * reflected[j + 1]);
    arriving = down * a;
  }
  light.transmittance = arriving * faces[count].passed;
  return light;
}

StackLight unpolarised_light(const OpticalStack& stack, double angle_rad) {
  StackLight mean = stack_light(stack, angle_rad, Polarisation::S);
  const StackLight p = stack_light(stack, angle_rad, Polarisation::P);
  mean.reflectance = (mean.reflectance + p.reflectance) / 2;
  mean.transmittance = (mean.transmittance + p.transmittance) / 2;
  for (size_t j = 0; j < mean.absorptance.size(); ++j)
    mean.absorptance[j] = (mean.absorptance[j] + p.absorptance[j]) / 2;
  return mean;
}

}  // namespace palpate::optics

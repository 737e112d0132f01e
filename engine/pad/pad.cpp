#include "engine/pad/pad.h"

#include <string>

#include "palpate/error.h"

namespace palpate {

double effective_modulus_MPa(const Material& pad, const Material& indenter) {
  const auto require = [](bool good, const char* wanted, double found) {
    if (!good) throw Error(Failure::Input, wanted, std::to_string(found), "checking the number and its unit");
  };
  double compliance = 0;
  for (const Material& m : {pad, indenter}) {
    require(m.young_MPa > 0, "a Young's modulus > 0 MPa", m.young_MPa);
    require(m.poisson >= 0 && m.poisson <= 0.5, "a Poisson ratio from 0 to 0.5", m.poisson);
    compliance += (1 - m.poisson * m.poisson) / m.young_MPa;
  }
  require(compliance > 0, "a body that is not rigid", compliance);
  return 1 / compliance;
}

Pad pad_of(const LayerCalibration& layer) {
  return {.material = {layer.young_MPa, layer.poisson}, .thickness_mm = layer.thickness_mm};
}

Pad pad_of(const ElasticCalibration& elastic) {
  Pad pad{.material = {elastic.young_MPa, elastic.poisson}};
  if (elastic.thickness_mm > 0) pad.thickness_mm = elastic.thickness_mm;
  return pad;
}

}  // namespace palpate

#include "perf/lab/forward/forward.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "engine/base/json.h"
#include "engine/base/text.h"

namespace palpate {
namespace {

using Json = json::Value;

}  // namespace

ForwardOutcome describe(const fem::Scene& scene, fem::Result result) {
  ForwardOutcome outcome{scene, std::move(result), {}, {}};
  if (!outcome.result.converged) return outcome;
  const PressureMap& stress = outcome.result.stress_Pa;
  outcome.profile = lump::profile_along_x(stress, lump::bump_center_mm(stress)[1]);
  const lump::Profile inner = inner_part(outcome.profile, 0.4 * scene.block_mm[0]);
  if (inner.x_mm.size() >= 6) outcome.fit = fit_gaussian(inner);
  // The solver's residual is not a bump.
  double largest = 0;
  for (const double stress_Pa : inner.value) largest = std::max(largest, std::abs(stress_Pa));
  if (std::abs(outcome.fit.amplitude) < 100 * outcome.result.residual * largest) outcome.fit.found = false;
  if (std::abs(outcome.fit.center_mm) < 1e-9) outcome.fit.center_mm = 0;
  return outcome;
}

Json to_json(const ForwardOutcome& o) {
  const fem::Result& r = o.result;
  Json value = {{"scene", to_json(o.scene)},  {"converged", r.converged}, {"residual", r.residual},
                {"iterations", r.iterations}, {"rounds", r.rounds},       {"wall_s", r.wall_s},
                {"memory_MB", megabytes(r)},  {"solver", r.solver}};
  if (!r.converged) return value;
  value["force_N"] = r.force_N;
  value["press_mm"] = r.press_mm;
  value["center_stress_Pa"] = r.center_stress_Pa;
  value["core_strain"] = r.core_strain;
  value["tension_share"] = r.tension_fraction;
  if (o.grid_error) {
    const fem::GridError& e = *o.grid_error;
    value["grid_error"] = {{"force_N", e.force_N},
                           {"press_mm", e.press_mm},
                           {"stress_rms_Pa", e.stress_Pa},
                           {"rim_order", e.rim_order ? Json(*e.rim_order) : Json(nullptr)}};
  }
  if (o.scene.presser == fem::Presser::Sphere) value["contact_radius_mm"] = r.contact_radius_mm;
  const lump::GaussianFit& f = o.fit;
  value["gaussian"] = {
      {"found", f.found},         {"amplitude_Pa", f.amplitude},       {"amplitude_sd_Pa", f.sd[0]},
      {"center_mm", f.center_mm}, {"center_sd_mm", f.sd[1]},           {"s_mm", f.width_mm},
      {"s_sd_mm", f.sd[2]},       {"s2_mm2", f.width_mm * f.width_mm}, {"offset_Pa", f.offset},
      {"offset_sd_Pa", f.sd[3]},  {"residual_rms_Pa", f.residual_rms}, {"r_squared", f.r_squared}};
  value["warnings"] = r.warnings;
  return value;
}

std::string to_text(const ForwardOutcome& o) {
  const fem::Result& r = o.result;
  const fem::Scene& s = o.scene;
  std::string text =
      headline(o) + "\n" +
      palpate::text("tissue          %g x %g x %g mm, %g Pa, Poisson's ratio %g, %u x %u x %u cells\n",
                    s.block_mm[0], s.block_mm[1], s.block_mm[2], s.young_Pa, s.poisson, s.cells[0],
                    s.cells[1], s.cells[2]);
  if (s.inclusion) {
    const auto size = s.inclusion->size();
    text += palpate::text("inclusion       %s %g x %g x %g mm, %g mm deep, %g times as stiff\n",
                          to_string(s.inclusion->shape), size[0], size[1], size[2], s.inclusion->depth_mm,
                          s.inclusion->stiffness_ratio);
  } else {
    text += "inclusion       none\n";
  }
  for (const fem::PadSheet& sheet : s.pad)
    text +=
        palpate::text("%s%g mm, %g Pa%s\n", &sheet == s.pad.data() ? "pad             " : "                ",
                      sheet.thickness_mm, sheet.young_Pa,
                      &sheet != s.pad.data() ? ""
                      : s.pad_slides         ? ", slides on the tissue"
                                             : ", bonded to the tissue");
  if (!r.converged)
    return text + (r.press_mm > 0
                       ? palpate::text("NOT CONVERGED   good up to %.4g mm and %.5g N (%s)\n", r.press_mm,
                                       r.force_N, r.solver.c_str())
                       : palpate::text("NOT CONVERGED   residual %.3g after %u iterations: no numbers\n",
                                       r.residual, r.iterations));
  text += palpate::text("press           %s, %.4g mm, %.5g N\n", to_string(s.presser), r.press_mm, r.force_N);
  text += palpate::text("stress          %.5g Pa in the middle", r.center_stress_Pa);
  text += std::isfinite(r.core_strain) ? palpate::text(", strain in the core %.4g\n", r.core_strain) : "\n";
  if (o.grid_error) {
    const fem::GridError& e = *o.grid_error;
    text += palpate::text("grid's error    %s, stress %.2g Pa (root of the mean square)",
                          s.press_mm ? palpate::text("force %.2g N", e.force_N).c_str()
                                     : palpate::text("press %.2g mm", e.press_mm).c_str(),
                          e.stress_Pa);
    text += e.rim_order ? palpate::text("; at the floor's rim of order %.2f\n", *e.rim_order) : "\n";
  }
  if (s.presser == fem::Presser::Sphere)
    text += palpate::text("contact         radius %.4g mm, +- half a cell of %.3g mm\n", r.contact_radius_mm,
                          r.stress_Pa.pitch_mm[0]);
  const lump::GaussianFit& f = o.fit;
  if (f.found)
    text += palpate::text(
        "Gaussian        a %.4g +- %.2g Pa, s %.4g +- %.2g mm (s^2 %.4g mm^2), at %.3g +- %.2g mm,\n"
        "                offset %.4g +- %.2g Pa, R^2 %.4f (errors: how far the line is from a Gaussian)\n",
        f.amplitude, f.sd[0], f.width_mm, f.sd[2], f.width_mm * f.width_mm, f.center_mm, f.sd[1], f.offset,
        f.sd[3], f.r_squared);
  else
    text += "Gaussian        none: the line holds no bump that stands out\n";
  text += palpate::text("solved          residual %.2g, %u iterations, %.2f s, %.0f MB\n", r.residual,
                        r.iterations, r.wall_s, megabytes(r));
  text += "solver          " + r.solver + "\n";
  for (const std::string& warning : r.warnings) text += "warning         " + warning + "\n";
  return text;
}

}  // namespace palpate

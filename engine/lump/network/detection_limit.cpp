#include "engine/lump/network/detection_limit.h"

#include <algorithm>
#include <cmath>

#include "engine/base/text.h"
#include "engine/lump/network/limit_search.h"
#include "palpate/error.h"

namespace palpate::lump {
namespace {

constexpr double kRatioTold = 4;  // stiffness ratio of the sentence

void check_forces(const Model& model, const PlannedPress& press) {
  const double most_N = 1e-6 * model.block_mm[0] * model.block_mm[1] * press.young_Pa * model.load[1];
  for (const double force_N : press.force_N)
    if (!(force_N > 0 && force_N <= most_N))
      throw Error(Failure::Usage,
                  text("forces above 0 and up to %.3g N, which the model knows on this tissue", most_N),
                  text("%.3g N", force_N), "--force-N in that range");
}

}  // namespace

std::vector<DetectionLimit> detection_limits(const Network& network, const PlannedPress& press) {
  const Model& model = network.model();
  check_forces(model, press);
  PalpationSensor sensor;
  sensor.window_mm = press.window_mm;
  // Noise is that of a value, all that rounds and trembles in it.
  sensor.pixel_noise_gray = 0;
  sensor.noise_fraction = sensor.pattern_fraction = 0;
  const auto observed = [&] {
    return plain_observation(model, press.thickness_mm, press.young_Pa, press.force_N, sensor, press.seed);
  };
  const std::vector<float> clear = observed().pressure_Pa.back().values;
  const double peak_Pa = static_cast<double>(*std::ranges::max_element(clear));
  if (std::max(press.noise_Pa, press.pattern_Pa) > peak_Pa)
    throw Error(Failure::Usage, text("noise and pattern below the highest pressure of %.3g Pa", peak_Pa),
                text("%.3g and %.3g Pa", press.noise_Pa, press.pattern_Pa), "--noise-Pa of one value");
  sensor.noise_fraction = press.noise_Pa / peak_Pa;
  sensor.pattern_fraction = press.pattern_Pa / peak_Pa;
  Observation observation = observed();
  observation.noise_Pa = press.noise_Pa;
  Estimate trouble;
  const auto nodes = pressed_nodes(model, observation, trouble);
  if (!nodes)
    throw Error(Failure::Usage, "tissue and forces that the model knows",
                trouble.reasons.empty() ? "others" : trouble.reasons.front(),
                "another thickness, modulus or force");
  return detection_limits(model, *nodes, Method::Refined);
}

std::string sentence_of(const std::vector<DetectionLimit>& limits) {
  std::string seen, unseen;
  for (const DetectionLimit& limit : limits) {
    if (limit.stiffness_ratio != kRatioTold) continue;
    std::string& to = std::isnan(limit.size_mm) ? unseen : seen;
    if (!to.empty()) to += ", ";
    to += std::isnan(limit.size_mm) ? text("%.3g", limit.depth_mm)
          : limit.size_mm <= kLeastSeen_mm
              ? text("%.2g mm or less if %.3g mm deep", limit.size_mm, limit.depth_mm)
              : text("%.2g mm if %.3g mm deep", limit.size_mm, limit.depth_mm);
  }
  if (seen.empty() && unseen.empty()) return {};
  const std::string what = text("a ball %.3g times as stiff as the tissue would ", kRatioTold);
  if (seen.empty()) return what + "not be seen here, of whatever size";
  return what + "be seen from " + seen + (unseen.empty() ? "" : "; not at all at " + unseen + " mm");
}

}  // namespace palpate::lump

#include "engine/palpation/hand/hand_answer.h"

#include <cmath>
#include <numbers>

#include "engine/lump/network/network.h"

namespace palpate {

HandAnswer answer_by_hand(const HandRecording& recording, const HandScanOptions& options,
                          const lump::Estimator& estimator, uint64_t seed) {
  constexpr double kDegrees = 180 / std::numbers::pi;
  const HandScan scan = hand_scan(recording.presses, lump::load_network("")->model(), options);
  HandAnswer answer{evaluate_scan(scan.presses, scan.stitch, estimator.until(options.places.stop), seed), {}};
  const size_t all = 3 * recording.presses.size();
  for (size_t p = 0; p < recording.presses.size(); ++p) {
    const HandPlace& place = scan.places.places[p];
    const auto sd = [&](size_t c) { return std::sqrt(scan.places.covariance[(3 * p + c) * (all + 1)]); };
    HandRow row{recording.presses[p].name, scan.left_out[p], place.at_mm, {sd(0), sd(1)},
                kDegrees * place.turn_rad, kDegrees * sd(2), scan.tilt[p]};
    for (const lump::PressPlace& in : answer.scan.map.places)
      if (in.name == row.name && !in.used) row.left_out = in.reason;
    answer.rows.push_back(std::move(row));
  }
  for (const auto& [name, reason] : recording.left_out)
    answer.rows.push_back({.name = name, .left_out = reason});
  return answer;
}

}  // namespace palpate

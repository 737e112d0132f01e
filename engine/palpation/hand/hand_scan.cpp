#include "engine/palpation/hand/hand_scan.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "engine/base/numbers.h"
#include "engine/base/text.h"
#include "engine/lump/network/block_hypotheses.h"
#include "engine/lump/network/view.h"
#include "engine/lump/observation/pad_tilt.h"
#include "engine/numeric/dense.h"
#include "palpate/error.h"

namespace palpate {
namespace {

constexpr double kPerDegree = std::numbers::pi / 180;
constexpr double kLeastForce = 0.5;  // of the usual highest force

/// Standard error of a place in the block: the skin's, the first press's, which moves and turns all, and
/// tremor.
double place_sd_mm(const HandScan& scan, size_t press, const HandScanOptions& options) {
  const size_t row = 3 * press, all = 3 * scan.places.places.size();
  const auto& at = scan.places.places[press].at_mm;
  const auto& skin = scan.places.covariance;
  const double away_mm = std::hypot(at[0] - options.places.first_mm[0], at[1] - options.places.first_mm[1]);
  return std::hypot(std::sqrt(std::max(skin[row * all + row], skin[(row + 1) * all + row + 1])),
                    std::hypot(options.places.first_sd_mm, options.tremor_sd_mm),
                    away_mm * options.places.first_turn_sd_rad / std::numbers::sqrt2);
}

class Levelling {
 public:
  Levelling(const std::vector<HandPress>& presses, const lump::Model& model, const HandScanOptions& options)
      : presses_(presses), model_(model), options_(options) {}

  HandScan run();

 private:
  void choose();
  void fill();
  lump::ScanMap stitched();
  void level(const lump::ScanMap& map);
  bool refuse_tilted(const lump::ScanMap& map);
  /// Tilt of one degree as PressPlace has it.
  double per_mm() const;

  const std::vector<HandPress>& presses_;
  const lump::Model& model_;
  const HandScanOptions& options_;
  std::vector<size_t> used_;
  HandScan out_;
};

double Levelling::per_mm() const {
  return kPerDegree / presses_[0].observation.block_mm[2];
}

/// Presses that have a place and about the others' force.
void Levelling::choose() {
  std::vector<double> highest;
  for (const HandPress& press : presses_) highest.push_back(press.observation.force_N.back());
  std::sort(highest.begin(), highest.end());
  const double least_N = kLeastForce * highest[highest.size() / 2];
  for (size_t p = 0; p < presses_.size(); ++p) {
    std::string reason = out_.places.places[p].reason;
    if (out_.places.places[p].placed && presses_[p].observation.force_N.back() < least_N)
      reason = text("it reached %.3g N, half of what others did", presses_[p].observation.force_N.back());
    if (reason.empty()) used_.push_back(p);
    out_.left_out.push_back(reason);
  }
}

void Levelling::fill() {
  out_.presses.clear();
  for (const size_t p : used_) {
    lump::ScanPress press{presses_[p].name, presses_[p].observation, out_.places.places[p].turn_rad};
    for (size_t c = 0; c < 2; ++c) press.observation.window_mm[c] = out_.places.places[p].at_mm[c];
    out_.presses.push_back(std::move(press));
  }
  out_.stitch.held_sd_mm.clear();
  for (const size_t p : used_) out_.stitch.held_sd_mm.push_back(place_sd_mm(out_, p, options_));
}

lump::ScanMap Levelling::stitched() {
  check_stop(options_.places.stop);
  fill();
  return lump::stitch(out_.presses, out_.stitch);
}

/// The tilt that all presses have in common, by the block's shape.
void Levelling::level(const lump::ScanMap& map) {
  lump::Estimate unused;
  const auto nodes = lump::pressed_nodes(model_, map.observation, unused);
  if (!nodes) return;
  const lump::Observation& seen = map.observation;
  const double rim_mm = seen.block_mm[0] / 2, area_m2 = 1e-6 * seen.block_mm[0] * seen.block_mm[1];
  // A tilt is nearly a share of the pressure: that at the middle load.
  const double force_N = seen.force_N[seen.force_N.size() / 2];
  const double rise = lump::rise_with_compression(lump::compression_under(force_N / area_m2, seen.young_Pa));
  const double sd = out_.stitch.tilt_sd_per_mm / std::sqrt(static_cast<double>(used_.size()));
  const lump::LinearFit fit = lump::BlockHypotheses(model_, *nodes, seen.uneven_sd).tilt(rim_mm * rise * sd);
  for (size_t c = 0; c < 2; ++c)
    out_.stitch.tilt_per_mm[c] += fit.value(static_cast<Eigen::Index>(c)) / (rim_mm * rise);
}

/// The press that is tilted most, where that is too much.
bool Levelling::refuse_tilted(const lump::ScanMap& map) {
  const double one = per_mm();
  double most = options_.most_tilt_deg;
  std::optional<size_t> worst;
  for (size_t k = 0; k < used_.size(); ++k) {
    const auto& t = map.places[k].tilt_per_mm;
    if (!map.places[k].used || std::hypot(t[0], t[1]) / one <= most) continue;
    most = std::hypot(t[0], t[1]) / one;
    worst = k;
  }
  if (!worst || used_.size() < 3) return false;
  out_.left_out[used_[*worst]] =
      text("the pad was tilted by %.2g degrees, more than %.2g", most, options_.most_tilt_deg);
  used_.erase(used_.begin() + static_cast<std::ptrdiff_t>(*worst));
  return true;
}

HandScan Levelling::run() {
  out_.places = place_presses(presses_, options_.places);
  choose();
  if (used_.size() < 2)
    throw Error(Failure::Input, "two presses by hand that can be used", std::to_string(used_.size()),
                "presses of like force that overlap by half");
  out_.stitch.tilt_sd_per_mm = options_.tilt_sd_deg * per_mm();
  out_.stitch.gain_sd = options_.gain_sd;
  out_.stitch.unlike_sd = options_.unlike_sd;
  lump::ScanMap map = stitched();
  for (int round = 0; round < 2; ++round) {
    level(map);
    map = stitched();
  }
  while (refuse_tilted(map)) map = stitched();
  out_.tilt.assign(presses_.size(), {kNaN, kNaN, kNaN});
  const double one = per_mm();
  for (size_t k = 0; k < used_.size(); ++k) {
    const lump::PressPlace& place = map.places[k];
    if (!place.used) continue;
    out_.tilt[used_[k]] = {place.tilt_per_mm[0] / one, place.tilt_per_mm[1] / one,
                           std::max(place.tilt_sd_per_mm[0], place.tilt_sd_per_mm[1]) / one};
  }
  return out_;
}

}  // namespace

HandScan hand_scan(const std::vector<HandPress>& presses, const lump::Model& model,
                   const HandScanOptions& options) {
  return Levelling(presses, model, options).run();
}

}  // namespace palpate

#include "engine/palpation/hand/press_reader.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <optional>

#include "engine/base/statistics.h"
#include "engine/base/text.h"
#include "engine/palpation/hand/held_pad.h"
#include "engine/palpation/hand/light_relief.h"
#include "engine/palpation/hand/skin_overlap.h"
#include "engine/sensor/fit.h"
#include "palpate/error.h"

namespace palpate {
namespace {

constexpr double kLeastShare = 0.015;  // force over area and modulus that a press reaches
constexpr double kStays_mm =
    1;  // what a pad moves from its highest force to the press's end: more is a slide
constexpr double kStation = 0.25;   // of the window's smaller side, from one station of a slide to the next
constexpr size_t kMostLooked = 60;  // frames of a slide that stations are chosen from
constexpr double kFarthestLoad = 0.1;  // of the highest load: a frame that stands for another
constexpr double kUsual = 0.5;         // of the median of the highest forces: a press that counts
constexpr double kFirst = 0.25;        // the same of the first one, without which there is no map
constexpr double kReached = 0.98;      // of the highest load

/// Where no frame is near a load, the nearest: its own force counts. None where that is far.
std::vector<size_t> frames_for(const std::vector<double>& force_N, double load_N, double top_N) {
  std::vector<size_t> near = frames_near(force_N, load_N, top_N);
  if (!near.empty()) return near;
  const auto highest = std::max_element(force_N.begin(), force_N.end());
  const auto nearest = std::min_element(force_N.begin(), highest, [&](double a, double b) {
    return std::abs(a - load_N) < std::abs(b - load_N);
  });
  if (std::abs(*nearest - load_N) <= kFarthestLoad * top_N)
    near.push_back(static_cast<size_t>(nearest - force_N.begin()));
  return near;
}

bool has(const std::vector<size_t>& frames, size_t frame) {
  return std::ranges::find(frames, frame) != frames.end();
}

}  // namespace

void check_hand(const Sensor& sensor, const FrameFormat& format, const PressReading& reading) {
  if (!reads_pressure(sensor) || !(sensor.pitch_mm_per_px > 0))
    throw Error(Failure::Sensor,
                "a sensor that reads pressure (surface.reading elastic) with a scale, for presses by hand",
                "'" + sensor.name + "'", "--sensor FILE of a calibrated sensor");
  const auto& block = reading.block_mm;
  bool right = reading.young_Pa > 0 && std::isfinite(reading.young_Pa);
  for (const double side : block) right = right && side > 0 && std::isfinite(side);
  if (!right)
    throw Error(Failure::Usage, "a block's sizes and modulus above 0",
                text("%g x %g x %g mm, %g Pa", block[0], block[1], block[2], reading.young_Pa),
                "--block-mm LENGTH WIDTH THICKNESS and --young-Pa as measured at a place without a lump");
  const double width = sensor.pitch_mm_per_px * format.width, height = sensor.pitch_mm_per_px * format.height;
  if (width > block[0] || height > block[1])
    throw Error(
        Failure::Usage, "a block larger than the pad, which goes from place to place on it",
        text("a block of %.4g x %.4g mm under a pad of %.4g x %.4g mm", block[0], block[1], width, height),
        "--block-mm of the whole block, or the pitch_mm_per_px of the sensor file");
}

double least_hand_press_N(const PressReading& r) {
  return kLeastShare * 1e-6 * r.block_mm[0] * r.block_mm[1] * r.young_Pa;
}

double common_force_N(const std::vector<double>& highest_N) {
  const double usual_N = median(highest_N);
  double top_N = *std::max_element(highest_N.begin(), highest_N.end());
  for (size_t p = 0; p < highest_N.size(); ++p)
    if (highest_N[p] >= (p == 0 ? kFirst : kUsual) * usual_N) top_N = std::min(top_N, 0.995 * highest_N[p]);
  return top_N;
}

bool PressPlan::wants(size_t frame) const {
  return trouble.empty() && (frame == held[0] || frame == held[1] || has(looked, frame) ||
                             std::ranges::any_of(loads, [&](const auto& near) { return has(near, frame); }));
}

PressPlan plan_press(std::string name, std::vector<double> force_N, double top_N, uint32_t loads) {
  PressPlan plan{std::move(name), std::move(force_N), top_N, {}, {}, {}, {}};
  const std::vector<double>& force = plan.force_N;
  const double highest_N = force.empty() ? 0 : *std::max_element(force.begin(), force.end());
  if (highest_N < kReached * top_N) {
    plan.trouble = text("it reached %.3g N, the scan %.3g N", highest_N, top_N);
    return plan;
  }
  for (uint32_t k = 1; k <= loads; ++k) {
    plan.loads.push_back(frames_for(force, hand_load(top_N, k, loads), top_N));
    if (!plan.loads.back().empty() && (k == 1 || plan.loads.back() != plan.loads[k - 2])) continue;
    plan.trouble = text("no frame within %.2g N of %.3g N while it loads", kFarthestLoad * top_N,
                        hand_load(top_N, k, loads));
    return plan;
  }
  const auto held = [&](double at_N) { return at_N >= 0.9 * highest_N; };
  const auto first = std::find_if(force.begin(), force.end(), held);
  const auto last = std::find_if(force.rbegin(), force.rend(), held);
  plan.held = {static_cast<size_t>(first - force.begin()),
               static_cast<size_t>(last.base() - force.begin()) - 1};
  const size_t step = (plan.held[1] - plan.held[0]) / kMostLooked + 1;
  for (size_t i = plan.held[0]; i <= plan.held[1]; i += step) plan.looked.push_back(i);
  return plan;
}

/// What the frames of one press have summed to.
struct PressReader::Sums {
  std::vector<LoadSums> loads;
  NodeSums relief;
  std::array<NodeSums, 2> held;
};

PressReader::PressReader(const Sensor& sensor, const Frame& background, const PressReading& reading)
    : reading_(reading),
      nodes_(sensor, background, reading.pitch_mm),
      fine_(sensor, background, relief_pitch_mm(sensor.pitch_mm_per_px)) {}

SkinRelief PressReader::relief_of(const NodeSums& sums, double force_N) const {
  double unused = 0, limited = 0;
  return relief_of_pressure(fine_.map(sums, unused, limited), force_N);
}

HandPress PressReader::press_of(const PressPlan& plan, const Sums& sums) const {
  HandPress press;
  press.name = plan.name;
  // Where the pad lies is found later: what hangs over the rim is told by its light.
  constexpr double kWide_mm = 1e4;
  press.observation = press_observation(
      nodes_, sums.loads, {{kWide_mm, kWide_mm, reading_.block_mm[2]}, reading_.young_Pa, {0, 0}});
  press.observation.block_mm = reading_.block_mm;
  for (PressureMap& map : press.observation.pressure_Pa) hide_untouched(map);
  press.relief = relief_of(sums.relief, sums.loads.back().force_N);
  return press;
}

/// By how much the pad slid while it pressed, mm; 0 where the skin does not tell. At one force: a block that
/// is pressed harder is wider.
double PressReader::slid_mm(const Sums& sums) const {
  const SkinOverlap again = find_skin_overlap(relief_of(sums.held[0], 0), relief_of(sums.held[1], 0));
  return !again.sure() ? 0 : std::hypot(again.shift_mm[0], again.shift_mm[1]);
}

/// Places along a slide, each a press at one load: the first frame, and each that has gone by kStation since.
/// Where the skin is not found again for so long, there is none.
std::vector<HandPress> PressReader::stations_of(const PressPlan& slide,
                                                const std::function<const Frame&(size_t)>& frame) const {
  std::vector<HandPress> stations;
  for (const size_t i : slide.looked) {
    Sums sums{std::vector<LoadSums>(1), {}, {}};
    sums.relief.add(fine_.read(frame(i)));
    if (!stations.empty()) {
      const SkinRelief& last = stations.back().relief;
      const SkinOverlap way = find_skin_overlap(last, relief_of(sums.relief, slide.force_N[i]));
      const double side_mm = last.pitch_mm * std::min(last.width, last.height);
      if (!way.sure() || std::hypot(way.shift_mm[0], way.shift_mm[1]) < kStation * side_mm) continue;
    }
    sums.loads[0].nodes.add(nodes_.read(frame(i)));
    sums.loads[0].force_N = slide.force_N[i];
    HandPress here = press_of(slide, sums);
    here.name += ", place " + std::to_string(stations.size() + 1);
    stations.push_back(std::move(here));
  }
  return stations;
}

ReadPress PressReader::read(const PressPlan& plan, const std::function<const Frame&(size_t)>& frame) const {
  Sums sums{std::vector<LoadSums>(plan.loads.size()), {}, {}};
  for (size_t end = 0; end < 2; ++end) sums.held[end].add(fine_.read(frame(plan.held[end])));
  for (size_t k = 0; k < plan.loads.size(); ++k)
    for (const size_t i : plan.loads[k]) {
      sums.loads[k].nodes.add(nodes_.read(frame(i)));
      sums.loads[k].force_N += plan.force_N[i] / static_cast<double>(plan.loads[k].size());
      if (k + 1 == plan.loads.size()) sums.relief.add(fine_.read(frame(i)));
    }
  if (slid_mm(sums) >= kStays_mm) return {stations_of(plan, frame), true};
  return {{press_of(plan, sums)}, false};
}

void take_press(HandRecording& to, const PressPlan& plan, ReadPress read) {
  if (plan.trouble.empty()) {
    std::ranges::move(read.presses, std::back_inserter(to.presses));
    return;
  }
  if (to.presses.empty())
    throw Error(Failure::Input, "a first press that can be read, since the map lies where it was aimed at",
                plan.name + ": " + plan.trouble, "a smaller --force-N, or slower presses");
  to.left_out.emplace_back(plan.name, plan.trouble);
}

void keep_highest_load(HandRecording& of) {
  for (HandPress& press : of.presses) {
    lump::Observation& seen = press.observation;
    seen.pressure_Pa.erase(seen.pressure_Pa.begin(), seen.pressure_Pa.end() - 1);
    seen.force_N.erase(seen.force_N.begin(), seen.force_N.end() - 1);
  }
}

}  // namespace palpate

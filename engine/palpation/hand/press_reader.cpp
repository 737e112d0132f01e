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
constexpr double kStation = 0.25;   // of the window's smaller side, from one place of a slide to the next
constexpr size_t kMostLooked = 60;  // frames of a slide that places are chosen from
constexpr double kAbove = 0.4;      // of the highest load, from one load above it to the next
constexpr size_t kMostAbove = 4;
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

/// Above the scan's loads, what a slide's beginning shows on the way to its own highest force.
std::vector<std::vector<size_t>> frames_above(const std::vector<double>& force_N, double highest_N,
                                              double top_N) {
  std::vector<std::vector<size_t>> above;
  const double further = highest_N / top_N - 1;
  if (further < 0.1) return above;
  const auto steps = std::min(kMostAbove, static_cast<size_t>(std::ceil(further / kAbove)));
  for (size_t k = 1; k <= steps; ++k) {
    const double share = static_cast<double>(k) / static_cast<double>(steps);
    std::vector<size_t> near = frames_for(force_N, top_N + share * (0.995 * highest_N - top_N), highest_N);
    if (!near.empty()) above.push_back(std::move(near));
  }
  return above;
}

/// A relief as it is where the block is narrower by a factor, about the window's middle.
SkinRelief narrowed(const SkinRelief& relief, double factor) {
  if (factor == 1) return relief;
  SkinRelief out = relief;
  const double mid_x = (relief.width - 1) / 2.0, mid_y = (relief.height - 1) / 2.0;
  for (uint32_t y = 0; y < relief.height; ++y)
    for (uint32_t x = 0; x < relief.width; ++x) {
      const size_t n = size_t{y} * relief.width + x;
      const double i = mid_x + (x - mid_x) * factor, j = mid_y + (y - mid_y) * factor;
      out.contact[n] = 0;
      out.depth_mm[n] = 0;
      if (i < 0 || j < 0 || i >= relief.width - 1 || j >= relief.height - 1) continue;
      const auto i0 = static_cast<size_t>(i), j0 = static_cast<size_t>(j);
      const auto fx = static_cast<float>(i - static_cast<double>(i0)),
                 fy = static_cast<float>(j - static_cast<double>(j0));
      const size_t at = j0 * relief.width + i0, below = at + relief.width;
      const auto& d = relief.depth_mm;
      const auto& c = relief.contact;
      if (!c[at] || !c[at + 1] || !c[below] || !c[below + 1]) continue;
      out.depth_mm[n] =
          (1 - fy) * ((1 - fx) * d[at] + fx * d[at + 1]) + fy * ((1 - fx) * d[below] + fx * d[below + 1]);
      out.contact[n] = 1;
    }
  return out;
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
  const auto near = [&](const std::vector<std::vector<size_t>>& of) {
    return std::ranges::any_of(of, [&](const auto& frames) { return has(frames, frame); });
  };
  return trouble.empty() &&
         (frame == held[0] || frame == held[1] || has(looked, frame) || near(loads) || near(above));
}

PressPlan plan_press(std::string name, std::vector<double> force_N, double top_N, uint32_t loads) {
  PressPlan plan{std::move(name), std::move(force_N), top_N, {}, {}, {}, {}, {}};
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
  plan.above = frames_above(force, highest_N, top_N);
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

/// Whether the pad lay still until it began to slide at its highest force. A place that was not found again
/// may have been anywhere.
bool PressReader::stayed(const PressPlan& slide, const Sums& sums, const LoadLaw& law,
                         const std::function<const Frame&(size_t)>& frame) const {
  const double top_N = sums.loads.back().force_N;
  NodeSums lowest;
  lowest.add(fine_.read(frame(slide.loads.front().front())));
  const SkinRelief top = relief_of(sums.relief, top_N);
  const auto there = [&](const NodeSums& sum, double force_N) {
    const SkinRelief relief = narrowed(relief_of(sum, force_N), law.wider(force_N, top_N));
    const SkinOverlap again = find_skin_overlap(top, relief);
    return again.sure() && std::hypot(again.shift_mm[0], again.shift_mm[1]) < kStays_mm;
  };
  return there(lowest, sums.loads.front().force_N) && there(sums.held[0], slide.force_N[slide.held[0]]);
}

/// A place that the pad slides over, brought from its load to the scan's.
HandPress PressReader::place_of(const PressPlan& slide, size_t looked, const Frame& frame, const LoadLaw& law,
                                const SlideWay& way) const {
  Sums sums{std::vector<LoadSums>(1), {}, {}};
  sums.relief.add(fine_.read(frame));
  sums.loads[0].nodes.add(nodes_.read(frame));
  const double from_N = sums.loads[0].force_N = slide.force_N[looked];
  HandPress here = press_of(slide, sums);
  lump::Observation& seen = here.observation;
  const PressureMap own = seen.pressure_Pa[0];
  seen.pressure_Pa.clear();
  seen.force_N.clear();
  double error_Pa = 0;
  for (uint32_t k = 1; k <= reading_.loads; ++k) {
    seen.force_N.push_back(hand_load(slide.top_N, k, reading_.loads));
    seen.pressure_Pa.push_back(law.change(own, from_N, seen.force_N.back(), way, error_Pa));
  }
  seen.noise_Pa = std::hypot(seen.noise_Pa, error_Pa);
  here.wider = law.wider(from_N, slide.top_N);
  here.relief = narrowed(here.relief, here.wider);
  return here;
}

/// Places along a slide, each a press: where it began, and each that has gone by kStation since. Where the
/// skin is not found again for so long, there is none.
std::vector<HandPress> PressReader::places_of(const PressPlan& slide, const Sums& sums,
                                              const std::function<const Frame&(size_t)>& frame) const {
  std::vector<HandPress> places;
  LoadLaw law({}, reading_.block_mm, reading_.young_Pa);
  if (stayed(slide, sums, law, frame)) {
    Sums all = sums;
    for (const std::vector<size_t>& near : slide.above) {
      LoadSums load;
      for (const size_t i : near) {
        load.nodes.add(nodes_.read(frame(i)));
        load.force_N += slide.force_N[i] / static_cast<double>(near.size());
      }
      if (load.force_N > 1.05 * all.loads.back().force_N) all.loads.push_back(std::move(load));
    }
    law = LoadLaw(press_of(slide, all).observation, reading_.block_mm, reading_.young_Pa);
    places.push_back(press_of(slide, sums));
  }
  SlideWay way;
  std::optional<SkinRelief> last;
  for (const size_t i : slide.looked) {
    NodeSums fine;
    fine.add(fine_.read(frame(i)));
    SkinRelief relief = relief_of(fine, slide.force_N[i]);
    if (last) {
      const SkinOverlap gone = find_skin_overlap(*last, relief);
      const double side_mm = relief.pitch_mm * std::min(relief.width, relief.height);
      if (!gone.sure() || std::hypot(gone.shift_mm[0], gone.shift_mm[1]) < kStation * side_mm) continue;
      way = way.then({gone.shift_mm, gone.turn_rad});
    }
    if (last || places.empty()) places.push_back(place_of(slide, i, frame(i), law, way));
    last = std::move(relief);
  }
  for (size_t p = 0; p < places.size(); ++p) places[p].name += ", place " + std::to_string(p + 1);
  return places;
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
  if (slid_mm(sums) >= kStays_mm) return {places_of(plan, sums, frame), true};
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

}  // namespace palpate

#include "capture/run/hand_recording.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <memory>

#include "capture/open_source.h"
#include "capture/synthetic/tissue.h"
#include "engine/base/statistics.h"
#include "engine/base/text.h"
#include "engine/palpation/hand/held_pad.h"
#include "engine/palpation/hand/light_relief.h"
#include "engine/palpation/hand/skin_overlap.h"
#include "engine/palpation/press_detector.h"
#include "engine/palpation/press_observation.h"
#include "palpate/error.h"

namespace palpate {
namespace {

namespace fs = std::filesystem;

constexpr double kLeastShare = 0.015;  // force over area and modulus that a press reaches
constexpr double kStays_mm =
    1;  // what a pad moves from its highest force to the press's end: more is a slide
constexpr double kStation = 0.25;   // of the window's smaller side, from one station of a slide to the next
constexpr size_t kMostLooked = 60;  // frames of a slide that stations are chosen from
constexpr double kSeenAgain = 9;    // significance of a skin that is found again
constexpr double kFarthestLoad = 0.1;  // of the highest load: a frame that stands for another
constexpr double kUsual = 0.5;         // of the median of the highest forces: a press that counts

std::string gauge_of(const std::string& recording) {
  if (is_tissue(recording)) return "truth";
  for (const fs::path& folder : {fs::path(recording), fs::absolute(recording).parent_path()})
    if (fs::is_regular_file(folder / "gauge.csv")) return (folder / "gauge.csv").string();
  return "";
}

/// A press in a recording, and its frames for each load.
struct FoundPress {
  std::string name;
  PressSpan span;
  std::vector<std::vector<size_t>> frames;
  std::array<size_t, 2> held = {};  ///< first and last frame at nine tenths of its highest force
};

std::vector<FoundPress> presses_of(const PressTimeline& t, const std::string& recording, bool alone,
                                   double least_N) {
  std::vector<FoundPress> found;
  for (const PressSpan& span : find_presses(t.force_N, least_N)) {
    const std::string name = "press " + std::to_string(found.size() + 1);
    found.push_back({alone ? name : fs::path(recording).filename().string() + ", " + name, span, {}});
  }
  if (!found.empty()) return found;
  double most_N = 0;
  for (const double force_N : t.force_N) most_N = std::max(most_N, force_N);
  throw Error(Failure::Input, text("a press of %.2g N or more in '%s'", least_N, recording.c_str()),
              text("%.2g N at most", most_N), "the gauge's table of this recording, or --young-Pa");
}

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

/// Its frames near each load; the first load without one.
std::optional<double> find_frames(const PressTimeline& t, double top_N, uint32_t loads, FoundPress& press) {
  const auto from = t.force_N.begin() + static_cast<std::ptrdiff_t>(press.span.first);
  const std::vector<double> force_N(
      from, from + static_cast<std::ptrdiff_t>(press.span.last - press.span.first + 1));
  for (uint32_t k = 1; k <= loads; ++k) {
    press.frames.push_back(frames_for(force_N, hand_load(top_N, k, loads), top_N));
    const bool rises = k == 1 || press.frames.back() != press.frames[k - 2];
    if (press.frames.back().empty() || !rises) return hand_load(top_N, k, loads);
    for (size_t& frame : press.frames.back()) frame += press.span.first;
  }
  const auto held = [&](double force) { return force >= 0.9 * press.span.highest_N; };
  const auto first = std::find_if(force_N.begin(), force_N.end(), held);
  const auto last = std::find_if(force_N.rbegin(), force_N.rend(), held);
  press.held = {press.span.first + static_cast<size_t>(first - force_N.begin()),
                press.span.first + static_cast<size_t>(last.base() - force_N.begin()) - 1};
  return std::nullopt;
}

/// What the frames of one press have summed to.
struct Sums {
  std::vector<LoadSums> loads;
  NodeSums relief;
  std::array<NodeSums, 2> held;
};

std::vector<Sums> sums_of(const PressTimeline& t, const std::vector<FoundPress>& presses,
                          const PressureNodes& nodes, const PressureNodes& fine, uint32_t loads,
                          const RunWatch& watch) {
  std::vector<Sums> sums(presses.size(), {std::vector<LoadSums>(loads), {}, {}});
  const std::unique_ptr<Source> source = open_source(t.input.input, t.input.sensor);
  Frame frame;
  for (size_t i = 0; !watch.stopped() && source->next(frame); ++i)
    for (size_t p = 0; p < presses.size(); ++p) {
      if (i < presses[p].span.first || i > presses[p].span.last) continue;
      for (size_t end = 0; end < 2; ++end)
        if (i == presses[p].held[end]) sums[p].held[end].add(fine.read(frame));
      for (size_t k = 0; k < loads; ++k) {
        const std::vector<size_t>& near = presses[p].frames[k];
        if (std::find(near.begin(), near.end(), i) == near.end()) continue;
        sums[p].loads[k].nodes.add(nodes.read(frame));
        sums[p].loads[k].force_N += t.force_N[i] / static_cast<double>(near.size());
        if (k + 1 == loads) sums[p].relief.add(fine.read(frame));
      }
    }
  return sums;
}

SkinRelief relief_of(const NodeSums& sums, const PressureNodes& fine, double force_N) {
  double unused = 0, limited = 0;
  return relief_of_pressure(fine.map(sums, unused, limited), force_N);
}

HandPress press_of(const FoundPress& found, const Sums& sums, const PressureNodes& nodes,
                   const PressureNodes& fine, const RecordedOptions& options) {
  HandPress press;
  press.name = found.name;
  // Where the pad lies is found later: what hangs over the rim is told by its light.
  constexpr double kWide_mm = 1e4;
  press.observation = press_observation(
      nodes, sums.loads, {{kWide_mm, kWide_mm, options.block_mm[2]}, options.young_Pa, {0, 0}});
  press.observation.block_mm = options.block_mm;
  for (PressureMap& map : press.observation.pressure_Pa) hide_untouched(map);
  press.relief = relief_of(sums.relief, fine, sums.loads.back().force_N);
  return press;
}

/// By how much the pad slid while it pressed, mm; 0 where the skin does not tell. At one force: a block that
/// is pressed harder is wider.
double slid_mm(const Sums& sums, const PressureNodes& fine) {
  const SkinOverlap again =
      find_skin_overlap(relief_of(sums.held[0], fine, 0), relief_of(sums.held[1], fine, 0));
  return again.significance < kSeenAgain ? 0 : std::hypot(again.shift_mm[0], again.shift_mm[1]);
}

/// Places along a slide, each a press at one load: the first frame, and each that has gone by kStation since.
/// Where the skin is not found again for so long, there is none.
std::vector<HandPress> stations_of(const PressTimeline& t, const FoundPress& slide,
                                   const PressureNodes& nodes, const PressureNodes& fine,
                                   const RecordedOptions& options, const RunWatch& watch) {
  std::vector<HandPress> stations;
  const size_t step = (slide.held[1] - slide.held[0]) / kMostLooked + 1;
  const std::unique_ptr<Source> source = open_source(t.input.input, t.input.sensor);
  Frame frame;
  for (size_t i = 0; i <= slide.held[1] && !watch.stopped() && source->next(frame); ++i) {
    if (i < slide.held[0] || (i - slide.held[0]) % step != 0) continue;
    Sums sums{std::vector<LoadSums>(1), {}, {}};
    sums.relief.add(fine.read(frame));
    if (!stations.empty()) {
      const SkinRelief& last = stations.back().relief;
      const SkinOverlap way = find_skin_overlap(last, relief_of(sums.relief, fine, t.force_N[i]));
      const double side_mm = last.pitch_mm * std::min(last.width, last.height);
      if (way.significance < kSeenAgain || std::hypot(way.shift_mm[0], way.shift_mm[1]) < kStation * side_mm)
        continue;
    }
    sums.loads[0].nodes.add(nodes.read(frame));
    sums.loads[0].force_N = t.force_N[i];
    HandPress here = press_of(slide, sums, nodes, fine, options);
    here.name += ", place " + std::to_string(stations.size() + 1);
    stations.push_back(std::move(here));
  }
  return stations;
}

/// A slide tells one load, and all presses of a scan have the same.
void keep_highest_load(std::vector<HandPress>& presses) {
  for (HandPress& press : presses) {
    lump::Observation& seen = press.observation;
    seen.pressure_Pa.erase(seen.pressure_Pa.begin(), seen.pressure_Pa.end() - 1);
    seen.force_N.erase(seen.force_N.begin(), seen.force_N.end() - 1);
  }
}

}  // namespace

HandRecording read_hand_presses(const std::vector<std::string>& recordings, const std::string& gauge,
                                const RecordedOptions& options, std::vector<std::string>& notes,
                                const RunWatch& watch) {
  const double least_N = kLeastShare * 1e-6 * options.block_mm[0] * options.block_mm[1] * options.young_Pa;
  std::vector<PressTimeline> timelines;
  std::vector<std::vector<FoundPress>> found;
  std::vector<double> highest_N;
  const RunWatch::Progress measured = watch.begin("finding presses", recordings.size());
  for (const std::string& recording : recordings) {
    timelines.push_back(measure_press(options.seed,
                                      {recording, {}, gauge.empty() ? gauge_of(recording) : gauge},
                                      options.sensor, notes, watch));
    if (watch.stopped()) return {};
    found.push_back(presses_of(timelines.back(), recording, recordings.size() == 1, least_N));
    for (const FoundPress& press : found.back()) highest_N.push_back(press.span.highest_N);
    measured(found.size());
  }
  const double usual_N = kUsual * median(highest_N);
  double top_N = *std::max_element(highest_N.begin(), highest_N.end());
  for (const double force_N : highest_N)
    if (force_N >= usual_N) top_N = std::min(top_N, 0.995 * force_N);
  if (options.force_N > 0) top_N = options.force_N;

  HandRecording out;
  size_t slides = 0;
  const RunWatch::Progress averaged = watch.begin("averaging frames", recordings.size());
  for (size_t r = 0; r < recordings.size(); ++r) {
    const PressTimeline& t = timelines[r];
    std::vector<FoundPress> good;
    for (FoundPress& press : found[r]) {
      if (press.span.highest_N < 0.98 * top_N)
        out.left_out.emplace_back(press.name,
                                  text("it reached %.3g N, the scan %.3g N", press.span.highest_N, top_N));
      else if (const auto lacking_N = find_frames(t, top_N, options.loads, press))
        out.left_out.emplace_back(press.name, text("no frame within %.2g N of %.3g N while it loads",
                                                   kFarthestLoad * top_N, *lacking_N));
      else
        good.push_back(press);
    }
    if (r == 0 && (good.empty() || good[0].name != found[0][0].name))
      throw Error(Failure::Input, "a first press that can be read, since the map lies where it was aimed at",
                  out.left_out[0].first + ": " + out.left_out[0].second,
                  "a smaller --force-N, or slower presses");
    const PressureNodes nodes(t.input.sensor, t.background, options.pitch_mm);
    const PressureNodes fine(t.input.sensor, t.background, relief_pitch_mm(t.input.sensor.pitch_mm_per_px));
    const std::vector<Sums> sums = sums_of(t, good, nodes, fine, options.loads, watch);
    if (watch.stopped()) return {};
    for (size_t p = 0; p < good.size(); ++p) {
      HandPress press = press_of(good[p], sums[p], nodes, fine, options);
      const double slid = slid_mm(sums[p], fine);
      if (slid < kStays_mm) {
        out.presses.push_back(std::move(press));
        continue;
      }
      ++slides;
      std::ranges::move(stations_of(t, good[p], nodes, fine, options, watch),
                        std::back_inserter(out.presses));
    }
    averaged(r + 1);
  }
  if (slides > 0) {
    keep_highest_load(out.presses);
    notes.push_back(
        text("the pad slid in %zu of the presses: the scan is at one load, that of each slide", slides));
  }
  return out;
}

}  // namespace palpate

#include "capture/run/palpation/hand_recording.h"

#include <algorithm>
#include <map>
#include <memory>

#include "capture/open_source.h"
#include "capture/synthetic/tissue.h"
#include "engine/base/stop.h"
#include "engine/base/text.h"
#include "engine/palpation/press_detector.h"
#include "palpate/error.h"

namespace palpate {
namespace {

namespace fs = std::filesystem;

std::string gauge_of(const std::string& recording) {
  if (is_tissue(recording)) return "truth";
  for (const fs::path& folder : {fs::path(recording), fs::absolute(recording).parent_path()})
    if (fs::is_regular_file(folder / "gauge.csv")) return (folder / "gauge.csv").string();
  return "";
}

/// A press in a recording.
struct FoundPress {
  std::string name;
  PressSpan span;
};

std::vector<FoundPress> presses_of(const PressTimeline& t, const std::string& recording, bool alone,
                                   double least_N) {
  std::vector<FoundPress> found;
  for (const PressSpan& span : find_presses(t.force_N, least_N)) {
    const std::string name = "press " + std::to_string(found.size() + 1);
    found.push_back({alone ? name : fs::path(recording).filename().string() + ", " + name, span});
  }
  if (!found.empty()) return found;
  double most_N = 0;
  for (const double force_N : t.force_N) most_N = std::max(most_N, force_N);
  throw Error(Failure::Input, text("a press of %.2g N or more in '%s'", least_N, recording.c_str()),
              text("%.2g N at most", most_N), "the gauge's table of this recording, or --young-Pa");
}

/// Reads the presses of one recording, which is gone through once; returns how many of them slid.
size_t read_recording(const PressTimeline& t, const std::vector<FoundPress>& found, double top_N,
                      const PressReading& reading, const RunWatch& watch, HandRecording& out) {
  const PressReader reader(t.input.sensor, t.background, reading);
  const std::unique_ptr<Source> source = open_source(t.input.input, t.input.sensor);
  size_t slides = 0, next = 0;
  for (const FoundPress& press : found) {
    const size_t first = press.span.first, last = press.span.last;
    const PressPlan plan = plan_press(press.name,
                                      {t.force_N.begin() + static_cast<std::ptrdiff_t>(first),
                                       t.force_N.begin() + static_cast<std::ptrdiff_t>(last) + 1},
                                      top_N, reading.loads);
    std::map<size_t, Frame> frames;
    for (Frame frame; next <= last && !watch.stopped() && source->next(frame); ++next)
      if (next >= first && plan.wants(next - first)) frames[next - first] = frame;
    if (watch.stopped()) return slides;
    ReadPress read;
    if (plan.trouble.empty())
      read = reader.read(plan, [&](size_t i) -> const Frame& {
        check_stop(watch.stop);
        return frames.at(i);
      });
    slides += read.slid;
    take_press(out, plan, std::move(read));
  }
  return slides;
}

}  // namespace

HandRecording read_hand_presses(const std::vector<std::string>& recordings, const std::string& gauge,
                                const RecordedOptions& options, std::vector<std::string>& notes,
                                const RunWatch& watch) {
  const PressReading reading{options.block_mm, options.young_Pa, options.loads, options.pitch_mm};
  const double least_N = least_hand_press_N(reading);
  if (options.force_N > 0 && options.force_N < least_N)
    throw Error(Failure::Usage, text("--force-N of %.2g N or more, from which on a pad presses", least_N),
                text("%g N", options.force_N), "without it: what nearly all presses reached");
  std::vector<PressTimeline> timelines;
  std::vector<std::vector<FoundPress>> found;
  std::vector<double> highest_N;
  const RunWatch::Progress measured = watch.begin("finding presses", recordings.size());
  for (const std::string& recording : recordings) {
    timelines.push_back(measure_press(options.seed,
                                      {recording, {}, gauge.empty() ? gauge_of(recording) : gauge},
                                      options.sensor, notes, watch));
    if (watch.stopped()) return {};
    check_hand(timelines.back().input.sensor, timelines.back().background.format, reading);
    found.push_back(presses_of(timelines.back(), recording, recordings.size() == 1, least_N));
    for (const FoundPress& press : found.back()) highest_N.push_back(press.span.highest_N);
    measured(found.size());
  }
  const double top_N = options.force_N > 0 ? options.force_N : common_force_N(highest_N);

  HandRecording out;
  size_t slides = 0;
  const RunWatch::Progress averaged = watch.begin("averaging frames", recordings.size());
  for (size_t r = 0; r < recordings.size(); ++r) {
    slides += read_recording(timelines[r], found[r], top_N, reading, watch, out);
    if (watch.stopped()) return {};
    averaged(r + 1);
  }
  if (out.presses.size() < 2 && !out.left_out.empty())
    throw Error(Failure::Input, "two presses by hand or more that can be read",
                text("%zu; ", out.presses.size()) + out.left_out[0].first + ": " + out.left_out[0].second,
                "more presses, of like force and slower");
  if (slides > 0)
    notes.push_back(
        text("the pad slid in %zu of the presses: places along a slide are brought from its load "
             "to those of the scan",
             slides));
  return out;
}

}  // namespace palpate

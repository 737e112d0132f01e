#include "capture/calibrate/untouched_recording.h"

#include <algorithm>

#include "capture/calibrate/photometric/frame_kinds.h"
#include "capture/open_source.h"
#include "capture/run/rest_check.h"
#include "engine/base/statistics.h"
#include "palpate/error.h"

namespace palpate {
namespace {

// Least difference between kinds of frames that counts as evidence.
constexpr double kNoEvidence = 0.002;
constexpr uint64_t kLeastTouched_px = 25;  // fewer above the threshold are no touch
constexpr size_t kLeastRest = 3;           // untouched frames that show the noise

Frame own_copy(const Frame& frame) {
  Frame own;
  own.reshape(frame.format);
  std::copy_n(frame.pixels(), frame.format.frame_bytes(), own.bytes.data());
  own.sequence = frame.sequence;
  return own;
}

/// Hands every `step`-th frame to `use`, at most FrameKinds::kMost; false: stopped.
bool look_through(const std::string& input, const Sensor& sensor, uint32_t step,
                  const std::function<bool(uint64_t)>& more,
                  const std::function<void(const Frame&, uint64_t number)>& use) {
  const std::unique_ptr<Source> source = open_source(input, sensor);
  Frame frame;
  uint64_t looked = 0;
  for (uint64_t n = 0; looked < FrameKinds::kMost && source->next(frame); ++n) {
    if (n % step != 0) continue;
    use(frame, n);
    if (!more(++looked)) return false;
  }
  return true;
}

/// How much of a touch each kind shows that others lack, as a fraction of the picture.
std::vector<double> touch_shown(const std::vector<Frame>& examples, const std::string& input,
                                const Sensor& sensor, uint32_t step,
                                const std::function<bool(uint64_t)>& more) {
  std::vector<double> shown(examples.size());
  if (sensor.signal != Signal::Either) {
    // It is known which way a touch changes the picture.
    for (size_t i = 0; i < examples.size(); ++i)
      for (const Frame& other : examples) {
        const FrameFormat& f = other.format;
        const auto pixels =
            static_cast<double>(change_above(examples[i], other, sensor, clear_threshold(0, f)).pixels);
        shown[i] += pixels / (static_cast<double>(f.width) * f.height) / static_cast<double>(examples.size());
      }
    return shown;
  }
  std::vector<RestCheck> checks;
  checks.reserve(examples.size());
  for (const Frame& example : examples) checks.emplace_back(example, sensor);
  look_through(input, sensor, step, more, [&](const Frame& frame, uint64_t) {
    for (RestCheck& check : checks) check.add(frame);
  });
  for (size_t i = 0; i < checks.size(); ++i) shown[i] = checks[i].evidence();
  return shown;
}

/// The kind whose frames show least that is missing in the others: a touch. Of several that show nothing the
/// first, for recordings mostly begin before the touch.
size_t untouched_kind(const std::vector<FrameKinds::Kind>& kinds, const std::string& input,
                      const Sensor& sensor, uint32_t step, const std::function<bool(uint64_t)>& more,
                      std::vector<uint64_t>& rivals) {
  if (kinds.size() < 2) return 0;
  std::vector<Frame> examples(kinds.size());
  look_through(input, sensor, step, more, [&](const Frame& frame, uint64_t number) {
    for (size_t i = 0; i < kinds.size(); ++i)
      if (uint64_t{kinds[i].example} * step == number) examples[i] = own_copy(frame);
  });
  const std::vector<double> shown = touch_shown(examples, input, sensor, step, more);
  const double least = std::ranges::min(shown);
  size_t first = kinds.size();
  for (size_t i = 0; i < kinds.size(); ++i) {
    if (shown[i] > least + kNoEvidence) continue;
    if (first < kinds.size()) rivals.push_back(uint64_t{kinds[i].members.front()} * step);
    first = std::min(first, i);
  }
  return first;
}

uint32_t step_of(const std::string& input, const Sensor& sensor, uint32_t every) {
  if (every > 0) return every;
  const uint64_t frames = open_source(input, sensor)->frame_count().value_or(0);
  return static_cast<uint32_t>(frames / FrameKinds::kMost + 1);
}

}  // namespace

UntouchedRecording find_untouched(const std::string& input, const Sensor& sensor,
                                  const UntouchedChoice& choice, const std::function<bool(uint64_t)>& more) {
  const uint32_t step = step_of(input, sensor, choice.every);
  FrameKinds all;
  Frame first;
  const bool whole = look_through(input, sensor, step, more, [&](const Frame& frame, uint64_t number) {
    if (number == 0) first = own_copy(frame);
    all.add(frame);
  });
  UntouchedRecording found;
  found.step = step;
  if (!whole) return found;
  found.looked = all.frames();
  if (found.looked == 1) {
    found.untouched = {0};
    found.image = untouched_picture(first, sensor);
    return found;
  }
  const std::vector<FrameKinds::Kind> kinds = all.find();
  size_t kind = 0;
  if (choice.like) {
    const auto has = [&](const FrameKinds::Kind& k) {
      return std::ranges::binary_search(k.members, static_cast<size_t>(*choice.like / step));
    };
    kind = static_cast<size_t>(std::ranges::find_if(kinds, has) - kinds.begin());
    if (kind == kinds.size())
      throw Error(
          Failure::Input, "an untouched frame with others like it",
          "frame " + std::to_string(*choice.like) + " of " + input + ", which less than two others are like",
          "another frame of the pad at rest, or one picture of it");
  } else {
    kind = untouched_kind(kinds, input, sensor, step, more, found.rivals);
  }
  if (!kinds.empty())
    for (const size_t i : kinds[kind].members) found.untouched.push_back(uint64_t{i} * step);
  if (found.untouched.empty())
    throw Error(Failure::Input, "frames in which nothing touches, three or more that are alike",
                "none among " + std::to_string(found.looked) + " of " + input,
                "a recording that shows the pad at rest for a moment, or one picture of it");
  // Evenly from all of them, so that a slow change of the light is in their mean.
  std::vector<Frame> frames;
  const size_t count = std::min<size_t>(std::max(2u, choice.frames), found.untouched.size());
  std::vector<uint64_t> chosen;
  for (size_t i = 0; i < count; ++i) chosen.push_back(found.untouched[i * found.untouched.size() / count]);
  look_through(input, sensor, step, more, [&](const Frame& frame, uint64_t number) {
    if (std::ranges::binary_search(chosen, number)) frames.push_back(own_copy(frame));
  });
  found.image = untouched_image(frames, sensor, true);
  // Noise is that of all of them; of some that a touch begins in, the most changed twentieth does not count.
  std::vector<double> changes;
  look_through(input, sensor, step, more, [&](const Frame& frame, uint64_t number) {
    if (std::ranges::binary_search(found.untouched, number))
      changes.push_back(largest_change(frame, found.image.mean, sensor));
  });
  std::ranges::sort(changes);
  if (!changes.empty()) {
    found.image.largest_change_gray = changes[(changes.size() - 1) * 19 / 20];
    found.image.threshold_gray = threshold_over(found.image.largest_change_gray);
  }
  return found;
}

void judge_threshold(const std::string& input, const Sensor& sensor, double threshold_gray,
                     UntouchedRecording& found, const std::function<bool(uint64_t)>& more) {
  found.threshold_gray = threshold_gray;
  found.touched_frames = found.untouched_that_touch = 0;
  double up = 0, down = 0, colour = 0;
  std::vector<double> areas, peaks;
  look_through(input, sensor, found.step, more, [&](const Frame& frame, uint64_t number) {
    const ChangeAbove change = change_above(frame, found.image.mean, sensor, threshold_gray);
    if (change.pixels < kLeastTouched_px) return;
    ++found.touched_frames;
    if (std::ranges::binary_search(found.untouched, number)) {
      ++found.untouched_that_touch;
      return;
    }
    areas.push_back(static_cast<double>(change.pixels));
    peaks.push_back(change.brightest / std::max(change.brightest + change.darkest, 1e-9));
    up += change.upwards;
    colour += change.colour;
    down += change.downwards;
  });
  found.touched_px = median(areas);
  found.brighter_peak = peaks.empty() ? 0.5 : median(peaks);
  found.brighter = up + down > 0 ? up / (up + down) : 0.5;
  found.colour = up + down > 0 ? colour / (up + down) : 0;
}

UntouchedRecording judge_touches(const std::string& input, const Sensor& sensor,
                                 const std::function<bool(uint64_t)>& more) {
  UntouchedRecording found;
  found.step = step_of(input, sensor, 0);
  const std::unique_ptr<Source> source = open_source(input, sensor);
  found.image.mean = load_background(input, sensor, *source);
  double threshold_gray = clear_threshold(sensor.threshold_gray, source->format());
  std::vector<double> rest_gray;
  const bool whole = look_through(input, sensor, found.step, more, [&](const Frame& frame, uint64_t number) {
    if (evident_touch_px(frame, found.image.mean, threshold_gray) >= kLeastTouched_px) return;
    found.untouched.push_back(number);
    rest_gray.push_back(largest_change(frame, found.image.mean, sensor));
  });
  if (!whole) return found;
  if (rest_gray.size() >= kLeastRest) {
    // Where one picture is the untouched image, its noise counts too. A touch that begins or ends is in some.
    std::ranges::sort(rest_gray);
    found.image.largest_change_gray = rest_gray[rest_gray.size() / 4];
    threshold_gray = std::max(threshold_gray, threshold_over(found.image.largest_change_gray));
  }
  judge_threshold(input, sensor, threshold_gray, found, more);
  found.touched_frames -= found.untouched_that_touch;
  return found;
}

double clear_threshold(double threshold_gray, const FrameFormat& format) {
  constexpr double kClear = 0.02;  // of full scale
  return std::max(threshold_gray, kClear * format.max_gray());
}

Signal signal_of(const UntouchedRecording& found) {
  // A gray gel darkens where it is pressed and brightens less beside it.
  constexpr double kOneSided = 0.6;
  if (shows_slopes_by_colour(found)) return Signal::Either;
  return found.brighter_peak > kOneSided       ? Signal::Brighter
         : found.brighter_peak < 1 - kOneSided ? Signal::Darker
                                               : Signal::Either;
}

bool shows_slopes_by_colour(const UntouchedRecording& found) {
  constexpr double kApart = 0.25;  // gels of five makers 0.36 to 0.98, gray gels and a waveguide 0.08 to 0.13
  return found.colour > kApart;
}

std::string frame_ranges(const std::vector<uint64_t>& frames, uint32_t step) {
  constexpr size_t kMostRanges = 6;
  std::string text;
  size_t ranges = 0;
  for (size_t i = 0; i < frames.size();) {
    size_t end = i;
    while (end + 1 < frames.size() && frames[end + 1] == frames[end] + step) ++end;
    if (++ranges > kMostRanges) return text + ", ...";
    text += (text.empty() ? "" : ", ") + std::to_string(frames[i]);
    if (end > i) text += " to " + std::to_string(frames[end]);
    i = end + 1;
  }
  return (frames.size() == 1 ? "frame " : "frames ") + text;
}

}  // namespace palpate

#include "viz/live/history.h"

#include <algorithm>
#include <cmath>
#include <iterator>

namespace palpate::viz {
namespace {

/// Index of the value nearest to `wanted` in rising ones, of which there is one at least.
uint64_t nearest_in(const std::vector<double>& rising, double wanted) {
  const auto above = std::ranges::lower_bound(rising, wanted);
  if (above == rising.begin()) return 0;
  const auto index = static_cast<uint64_t>(above - rising.begin());
  const bool below = above == rising.end() || wanted - *std::prev(above) <= *above - wanted;
  return below ? index - 1 : index;
}

}  // namespace

double Timeline::length() const {
  const double last = frames > 0 ? static_cast<double>(frames - 1) : 0;
  if (timed && !uneven_s.empty()) return uneven_s.back();
  return timed && rate_Hz > 0 ? last / rate_Hz : last;
}

uint64_t Timeline::frame_at(double time) const {
  if (timed && !uneven_s.empty()) return nearest_in(uneven_s, time - start_s);
  const double frame = std::round(timed && rate_Hz > 0 ? (time - start_s) * rate_Hz : time);
  return static_cast<uint64_t>(std::clamp(frame, 0.0, frames > 0 ? static_cast<double>(frames - 1) : 0.0));
}

void History::mark(const Event& event) {
  events_.push_back({timeline_.timed ? event.time_s : static_cast<double>(event.frame), label_of(event)});
}

std::optional<double> History::next_event(double time, bool after) const {
  // The shown frame's own time is rounded otherwise than that of a mark at it.
  constexpr double kSame = 1e-6;
  std::optional<double> next;
  for (const EventMark& event : events_) {
    const bool beyond = after ? event.time > time + kSame : event.time < time - kSame;
    if (beyond && (!next || (after ? event.time < *next : event.time > *next))) next = event.time;
  }
  return next;
}

void History::add(const Touch& touch, std::optional<uint64_t> position) {
  // No line across a longer silence, s or frames; a slow recording is none.
  const double longest_gap =
      !timeline_.timed ? 10 : std::max(1.0, timeline_.rate_Hz > 0 ? 3 / timeline_.rate_Hz : 0);
  Sample s;
  s.position = position.value_or(touch.sequence);
  s.time = timeline_.timed ? 1e-9 * static_cast<double>(touch.time_ns) : static_cast<double>(touch.sequence);
  now_ = s.time;
  if (touch.picture != PictureFault::None) return;  // nothing was measured
  s.contact = touch.contact;
  s.several = touch.contacts.size() > 1;
  s.force_N = touch.force_N;
  s.shear_x_N = touch.shear_x_N;
  s.shear_y_N = touch.shear_y_N;
  if (touch.traction) s.layer_N = touch.traction->fz_N;
  s.gray_sum = touch.gray_sum;
  s.has_depth = touch.surface.has_value();
  s.depth_mm = touch.contact && touch.surface ? touch.surface->depth_max_mm : 0;
  s.depth_sd_mm = touch.contact && touch.surface ? touch.surface->depth_sd_mm : 0;
  s.slip = touch.slip;
  if (!timeline_.whole() && !samples_.empty() && s.time < samples_.back().time) samples_.clear();
  auto at = std::lower_bound(samples_.begin(), samples_.end(), s.time,
                             [](const Sample& sample, double time) { return sample.time < time; });
  if (at != samples_.end() && at->time == s.time)
    *at = s;
  else
    at = samples_.insert(at, s);
  const auto mend = [&](auto sample) {
    sample->gap = sample == samples_.begin() || sample->time - std::prev(sample)->time > longest_gap ||
                  (timeline_.whole() && sample->position != std::prev(sample)->position + 1);
  };
  mend(at);
  if (std::next(at) != samples_.end()) mend(std::next(at));
  if (timeline_.whole()) return;
  while (samples_.size() > 2 && samples_[1].time < s.time - kLongest_s) samples_.pop_front();
}

}  // namespace palpate::viz

#include "viz/live/history.h"

namespace palpate::viz {

void History::add(const Touch& touch) {
  constexpr double kGap_s = 1;  // no line across a longer silence
  Sample s;
  s.time_s = 1e-9 * static_cast<double>(touch.time_ns);
  s.contact = touch.contact;
  s.several = touch.contacts.size() > 1;
  s.force_N = touch.force_N;
  s.shear_x_N = touch.shear_x_N;
  s.shear_y_N = touch.shear_y_N;
  s.gray_sum = touch.gray_sum;
  s.has_depth = touch.surface.has_value();
  s.depth_mm = touch.contact && touch.surface ? touch.surface->depth_max_mm : 0;
  s.slip = touch.slip;
  if (!samples_.empty()) {
    if (s.time_s < samples_.back().time_s)
      samples_.clear();
    else if (s.time_s == samples_.back().time_s)
      samples_.pop_back();
  }
  s.gap = samples_.empty() || s.time_s - samples_.back().time_s > kGap_s;
  samples_.push_back(s);
  while (samples_.size() > 2 && samples_[1].time_s < s.time_s - kLongest_s) samples_.pop_front();
}

}  // namespace palpate::viz

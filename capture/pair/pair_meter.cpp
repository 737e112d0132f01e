#include "capture/pair/pair_meter.h"

namespace palpate {

PairMeter::PairMeter(const std::optional<KnownGrip>& grip)
    : posed_(grip.has_value()),
      geometry_(grip ? grip->file.geometry : GripGeometry{}),
      meter_(geometry_),
      opening_(grip ? grip->opening : OpeningSeries{}) {}

int64_t time_of(const Matched<FingerTouch>& pair) {
  if (!pair.left()) return pair.right()->time_ns;
  if (!pair.right()) return pair.left()->time_ns;
  return pair.left()->time_ns + (pair.right()->time_ns - pair.left()->time_ns) / 2;
}

int64_t begin_of(const Matched<FingerTouch>& pair) {
  return pair.both() ? pair.left()->time_ns : time_of(pair);
}

GripFrame PairMeter::add(const Matched<FingerTouch>& pair) {
  const auto &left = pair.left(), &right = pair.right();
  if (!zero_ns_) zero_ns_ = begin_of(pair);
  GripFrame frame;
  frame.time_ns = time_of(pair) - *zero_ns_;
  frame.opening_mm = opening_.at(1e-9 * static_cast<double>(frame.time_ns));
  if (left) frame.left = left->touch.sequence;
  if (right) frame.right = right->touch.sequence;
  if (left && right) {
    frame.skew_ms = 1e-6 * static_cast<double>(pair.skew_ns);
    frame.grip = meter_.add(left->touch, right->touch, frame.opening_mm);
    if (!posed_) {
      for (Estimate* unknown :
           {&frame.grip->load_x_N, &frame.grip->load_y_N, &frame.grip->load_z_N, &frame.grip->turn_rad})
        *unknown = {};
    }
  }
  return frame;
}

}  // namespace palpate

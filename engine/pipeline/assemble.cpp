#include "engine/pipeline/assemble.h"

#include <algorithm>
#include <initializer_list>
#include <iterator>
#include <utility>

#include "engine/base/numbers.h"

namespace palpate {
namespace {

struct Fault {
  bool holds;
  Validity says;
};

// The first that holds, of faults in their order, the gravest first.
Validity gravest(std::initializer_list<Fault> faults) {
  const auto first = std::ranges::find_if(faults, &Fault::holds);
  return first == faults.end() ? Validity::Valid : first->says;
}

// Changes of light are as likely as forces: numbers that are there say so. A calibration that is not fit for
// use stays the graver doubt.
template <typename Shape>
void doubt_forces(Shape& shape) {
  constexpr Validity kStays[] = {Validity::NotCalibrated, Validity::NoContact, Validity::NotFollowed,
                                 Validity::Unfit};
  for (Estimate* force : {&shape.force_N, &shape.shear_x_N, &shape.shear_y_N})
    if (std::ranges::find(kStays, force->validity) == std::end(kStays))
      force->validity = Validity::LightUnknown;
}

void write_contact(FrameParts& parts, Touch& touch) {
  const ContactTouch& whole = parts.whole;
  touch.contact = parts.touched();
  touch.gray_sum = whole.gray_sum;
  touch.centroid_x_px = whole.centroid_x_px;
  touch.centroid_y_px = whole.centroid_y_px;
  touch.area_px = whole.area_px;
  touch.area_mm2 = whole.area_mm2;
  touch.ellipse = whole.ellipse;
  touch.peak_gray = whole.peak_gray;
  touch.saturated_px = whole.saturated_px;
  touch.at_border = whole.at_border;
  touch.regions = parts.regions;
  touch.contacts.swap(parts.contacts);
  touch.gradient_sum = parts.gradient_sum;
  touch.confidence = parts.confidence;
  touch.markers = parts.markers;
  if (parts.follows_skin) touch.skin.emplace();
  touch.skin_points.swap(parts.skin_points);
}

void write_surface(const SurfacePart& part, const FrameParts& parts, bool light_unknown, Touch& touch) {
  touch.surface = part.summary;
  DepthFaults faults = part.faults;
  faults.light_unknown = faults.light_unknown || light_unknown;
  faults.untouched = !parts.touched();
  touch.surface->validity = validity_of(faults);
}

void write_traction(const TractionPart& part, const FrameParts& parts, bool light_unknown, Touch& touch) {
  touch.traction = part.summary;
  const Validity validity = validity_of({.light_unknown = light_unknown,
                                         .not_converged = part.not_converged,
                                         .depth = touch.surface->validity,
                                         .at_border = parts.whole.at_border,
                                         .too_deep = part.too_deep,
                                         .covered = part.covered});
  for (Estimate* one : components(*touch.traction))
    if (one->valid()) one->validity = validity;
}

// No contact, states that say so, and values that are no numbers.
void write_spoilt(const FrameParts& parts, Touch& touch) {
  constexpr Estimate kUnknown{kNaN, kNaN, Validity::PictureDamaged};
  for (double* value :
       {&touch.gray_sum, &touch.centroid_x_px, &touch.centroid_y_px, &touch.area_mm2, &touch.peak_gray,
        &touch.shift_x_mm, &touch.shift_y_mm, &touch.shift_x_px, &touch.shift_y_px})
    *value = kNaN;
  touch.ellipse = {kNaN, kNaN, kNaN, kNaN, kNaN};
  touch.force_N = touch.shear_x_N = touch.shear_y_N = kUnknown;
  touch.slip = Slip::PictureDamaged;
  if (touch.light) touch.light = {LightState::Unknown, kNaN};
  if (parts.surface) {
    SurfaceSummary& s = touch.surface.emplace();
    s.validity = Validity::PictureDamaged;
    s.depth_max_mm = s.depth_sd_mm = s.volume_mm3 = kNaN;
  }
  if (parts.traction) {
    TractionSummary& t = touch.traction.emplace();
    for (Estimate* one : components(t)) *one = kUnknown;
    t.pressure_max_kPa = t.shear_max_kPa = t.area_mm2 = t.unexplained_slope = kNaN;
  }
}

}  // namespace

Validity validity_of(const DepthFaults& f) {
  return gravest({{f.light_unknown, Validity::LightUnknown},
                  {f.apart, Validity::Apart},
                  {f.saturated, Validity::Saturated},
                  {f.at_border, Validity::AtBorder},
                  {f.above_range, Validity::AboveRange},
                  {f.clipped, Validity::Clipped},
                  {f.too_deep, Validity::TooDeep},
                  {f.covered, Validity::Covered},
                  {f.extrapolated, Validity::Extrapolated},
                  {f.untouched, Validity::NoContact}});
}

Validity validity_of(const WrenchFaults& f) {
  return gravest({{f.light_unknown, Validity::LightUnknown},
                  {f.not_converged, Validity::NotConverged},
                  {f.depth != Validity::Valid && f.depth != Validity::NoContact, f.depth},
                  {f.at_border, Validity::AtBorder},
                  {f.too_deep, Validity::TooDeep},
                  {f.covered, Validity::Covered}});
}

void assemble(FrameParts& parts, const FrameStamp& stamp, TouchHistory& history, Touch& touch) {
  touch.sequence = stamp.sequence;
  touch.time_ns = stamp.time_ns;
  touch.picture = stamp.fault;
  touch.repeated = stamp.repeated;
  touch.light = parts.light_unknown ? LightSummary{.state = LightState::Unknown} : stamp.light;
  touch.object = parts.object;
  if (stamp.fault != PictureFault::None) return write_spoilt(parts, touch);
  const bool light_unknown = touch.light && touch.light->state == LightState::Unknown;
  write_contact(parts, touch);
  if (parts.surface) write_surface(*parts.surface, parts, light_unknown, touch);
  if (parts.traction) write_traction(*parts.traction, parts, light_unknown, touch);
  history.follow(touch, stamp.after_gap, parts.skin_sd_px);
  if (!light_unknown) return;
  doubt_forces(touch);
  for (ContactTouch& contact : touch.contacts) doubt_forces(contact);
}

}  // namespace palpate

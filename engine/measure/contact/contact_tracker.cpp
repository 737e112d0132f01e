#include "engine/measure/contact/contact_tracker.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <utility>

namespace palpate {
namespace {

constexpr uint32_t kNoTrack = UINT32_MAX;

double radius_px(const ContactTouch& contact) {
  return std::sqrt(static_cast<double>(contact.area_px) / std::numbers::pi);
}

// How far a contact may have gone from one frame to the next.
double gate_px(const ContactTouch& a, const ContactTouch& b) {
  return 2 * std::max(radius_px(a), radius_px(b)) + 4;
}

double squared_way(const ContactTouch& a, const ContactTouch& b) {
  const double dx = a.centroid_x_px - b.centroid_x_px, dy = a.centroid_y_px - b.centroid_y_px;
  return dx * dx + dy * dy;
}

// A sum has the gravest state of its contacts' numbers.
Validity graver(Validity a, Validity b) {
  constexpr Validity kGravest[] = {Validity::NotCalibrated, Validity::Unfit,        Validity::Saturated,
                                   Validity::AtBorder,      Validity::OnsetUnseen,  Validity::AboveRange,
                                   Validity::BelowRange,    Validity::ShapeUnjudged};
  for (const Validity validity : kGravest)
    if (a == validity || b == validity) return validity;
  return Validity::Valid;
}

}  // namespace

ContactTracker::ContactTracker(const Sensor& sensor, const FrameFormat& format)
    : sensor_(sensor), smallest_px_(smallest_contact_px(sensor, format)) {
  // Those that are away for some frames are followed as well.
  constexpr size_t kTracks = kMostContacts * (kHeldFrames + 2);
  tracks_.reserve(kTracks);
  spare_skins_.reserve(kTracks);
  chosen_.reserve(kMostContacts);
  regions_.reserve(kMostContacts);
  track_of_.reserve(kMostContacts);
  cost_.reserve(2 * size_t{kMostContacts} * kMostContacts);
}

void ContactTracker::interrupt() {
  for (Track& track : tracks_) track.missed = kHeldFrames + 1;
  end_missing();
  interrupted_ = true;
}

void ContactTracker::update(Touch& touch, std::span<const float> skin_sd_px) {
  std::swap(regions_, touch.contacts);
  touch.contacts.clear();
  choose(touch);
  match();
  for (Track& track : tracks_) ++track.missed;
  for (size_t i = 0; i < regions_.size(); ++i) {
    if (track_of_[i] == kNoTrack && regions_[i].area_px < smallest_px_) {
      ++touch.regions->small;
      continue;
    }
    Track& track = track_of_[i] == kNoTrack ? begin() : tracks_[track_of_[i]];
    track.lineage = regions_[i].id;
    regions_[i].id = track.last.id;
    regions_[i].frames = track.last.frames + track.missed;
    track.last = regions_[i];
    track.missed = 0;
    measure(track, touch, skin_sd_px);
  }
  interrupted_ = false;
  end_missing();
  for (const Track& track : tracks_)
    if (track.missed == 0) touch.contacts.push_back(track.last);
  if (touch.skin && !touch.contacts.empty()) sum_skin(touch);
  add_up(touch);
}

// Leaves the regions that may be contacts, the largest where there are too many.
void ContactTracker::choose(Touch& touch) {
  touch.regions->small +=
      std::erase_if(regions_, [&](const ContactTouch& region) { return 2 * region.area_px < smallest_px_; });
  if (regions_.size() <= kMostContacts) return;
  touch.regions->overflow = true;
  largest_.resize(regions_.size());
  std::iota(largest_.begin(), largest_.end(), 0u);
  // Equal ones in their order.
  std::ranges::sort(largest_, [&](uint32_t a, uint32_t b) {
    return regions_[a].area_px != regions_[b].area_px ? regions_[a].area_px > regions_[b].area_px : a < b;
  });
  chosen_.clear();
  for (size_t i = 0; i < kMostContacts; ++i) chosen_.push_back(regions_[largest_[i]]);
  std::swap(regions_, chosen_);
}

// The track of each region, or kNoTrack.
void ContactTracker::match() {
  track_of_.assign(regions_.size(), kNoTrack);
  const auto rows = static_cast<uint32_t>(tracks_.size());
  const auto count = static_cast<uint32_t>(regions_.size());
  if (rows == 0 || count == 0) return;
  double most = 1;
  for (const Track& track : tracks_)
    for (const ContactTouch& region : regions_)
      most = std::max(most, std::pow(gate_px(track.last, region), 2));
  // After the regions a column for each track that ends: dearer than any way, and dearest for one that was
  // there a frame ago.
  const double never = 1e3 * most * (rows + 1);
  const uint32_t columns = count + rows;
  cost_.assign(size_t{rows} * columns, never);
  for (uint32_t row = 0; row < rows; ++row) {
    const Track& track = tracks_[row];
    for (uint32_t i = 0; i < count; ++i) {
      const double way = squared_way(track.last, regions_[i]);
      if (way <= std::pow(gate_px(track.last, regions_[i]), 2)) cost_[size_t{row} * columns + i] = way;
    }
    cost_[size_t{row} * columns + count + row] = (track.missed == 0 ? 4 : 2) * most;
  }
  const std::vector<uint32_t>& column_of = assignment_.solve(cost_, rows, columns);
  for (uint32_t row = 0; row < rows; ++row)
    if (column_of[row] < count) track_of_[column_of[row]] = row;
  for (uint32_t i = 0; i < count; ++i)
    if (track_of_[i] == kNoTrack && regions_[i].id != 0) track_of_[i] = nearest_of_lineage(regions_[i]);
}

// Searches the tracks without a region.
uint32_t ContactTracker::nearest_of_lineage(const ContactTouch& region) const {
  uint32_t nearest = kNoTrack;
  for (uint32_t row = 0; row < tracks_.size(); ++row) {
    if (tracks_[row].lineage != region.id || std::ranges::find(track_of_, row) != track_of_.end()) continue;
    if (nearest == kNoTrack ||
        squared_way(tracks_[row].last, region) < squared_way(tracks_[nearest].last, region))
      nearest = row;
  }
  return nearest;
}

// A new contact.
ContactTracker::Track& ContactTracker::begin() {
  SkinTracker skin(sensor_);
  if (!spare_skins_.empty()) {
    skin = std::move(spare_skins_.back());
    spare_skins_.pop_back();
  }
  Track& track = tracks_.emplace_back(Track{.last = {},
                                            .missed = 1,
                                            .force = {},
                                            .shear = ShearTracker(sensor_.pitch_mm_per_px),
                                            .skin = std::move(skin)});
  track.last.id = ++last_id_;
  if (interrupted_) {
    track.force.interrupt();
    track.shear.interrupt();
    track.skin.interrupt();
  }
  return track;
}

void ContactTracker::end_missing() {
  const auto gone = [](const Track& track) { return track.missed > kHeldFrames; };
  for (Track& track : tracks_) {
    if (!gone(track)) continue;
    track.skin.restart();
    spare_skins_.push_back(std::move(track.skin));
  }
  std::erase_if(tracks_, gone);
}

void ContactTracker::sum_skin(Touch& touch) const {
  SkinMotion whole;
  const Estimate unknown{0, 0, Validity::NoContact};
  whole.shift_x_mm = whole.shift_y_mm = whole.torsion_rad = whole.stick_share = unknown;
  if (touch.contacts.size() == 1)
    whole = std::ranges::find(tracks_, 0u, &Track::missed)->motion;
  else
    for (const Track& track : tracks_)
      if (track.missed == 0) whole.touching += track.motion.touching;
  whole.points = touch.skin->points;
  whole.lost = touch.skin->lost;
  touch.skin = whole;
}

void ContactTracker::measure(Track& track, const Touch& touch, std::span<const float> skin_sd_px) const {
  ContactTouch& c = track.last;
  c.force_N = sensor_.force ? track.force.update(*sensor_.force, force_features(c)) : Estimate{};
  // The one contact of a touch is all that ShearTracker knows.
  Touch alone;
  alone.contact = true;
  alone.time_ns = touch.time_ns;
  alone.centroid_x_px = c.centroid_x_px;
  alone.centroid_y_px = c.centroid_y_px;
  alone.at_border = c.at_border;
  alone.force_N = c.force_N;
  if (touch.skin) {
    const ContactOutline outline{c.centroid_x_px, c.centroid_y_px, c.ellipse.major_px, c.ellipse.minor_px,
                                 c.ellipse.angle_rad};
    alone.skin = track.motion = track.skin.update(&outline, touch.skin_points, skin_sd_px);
  }
  track.shear.update(sensor_.shear ? &*sensor_.shear : nullptr, alone);
  c.shear_x_N = alone.shear_x_N;
  c.shear_y_N = alone.shear_y_N;
  c.shift_x_mm = alone.shift_x_mm;
  c.shift_y_mm = alone.shift_y_mm;
  c.shift_x_px = alone.shift_x_px;
  c.shift_y_px = alone.shift_y_px;
  c.slip = alone.slip;
}

void ContactTracker::add_up(Touch& touch) const {
  const std::vector<ContactTouch>& contacts = touch.contacts;
  if (contacts.empty()) return;
  if (sensor_.force &&
      (sensor_.force->signal == ForceSignal::GraySum || sensor_.force->signal == ForceSignal::Area) &&
      contacts.size() > 1) {
    // Errors of the calibration are common to all contacts; single readings scatter independently.
    const ForceCalibration& calibration = *sensor_.force;
    Estimate sum{0, 0, Validity::Valid};
    double scatter = 0, common_N = 0;
    for (const ContactTouch& contact : contacts) {
      const Estimate& force = contact.force_N;
      const double total = force.standard_error * force.standard_error;
      const double own = std::min(total, std::pow(calibration.residual_sd_N, 2) +
                                             std::pow(growing_scatter_N(calibration, force.value), 2));
      sum.value += force.value;
      sum.validity = graver(sum.validity, force.validity);
      scatter += own;
      common_N += std::sqrt(total - own);
    }
    sum.standard_error = std::hypot(std::sqrt(scatter), common_N);
    touch.force_N = sum;
  }
  if (!sensor_.shear) return;
  Estimate x{0, 0, Validity::Valid}, y = x;
  Slip slip = Slip::Stick;
  const auto add = [](Estimate& sum, const Estimate& more) {
    sum.value += more.value;
    sum.standard_error = std::hypot(sum.standard_error, more.standard_error);
    sum.validity = graver(sum.validity, more.validity);
  };
  for (const ContactTouch& contact : contacts) {
    add(x, contact.shear_x_N);
    add(y, contact.shear_y_N);
    if (contact.slip == Slip::NotCalibrated || slip == Slip::NotCalibrated)
      slip = Slip::NotCalibrated;
    else if (contact.slip != Slip::Stick && slip != Slip::Slip)
      slip = contact.slip;
  }
  touch.shear_x_N = x;
  touch.shear_y_N = y;
  touch.slip = slip;
  if (contacts.size() > 1) return;
  touch.shift_x_mm = contacts.front().shift_x_mm;
  touch.shift_y_mm = contacts.front().shift_y_mm;
  touch.shift_x_px = contacts.front().shift_x_px;
  touch.shift_y_px = contacts.front().shift_y_px;
}

}  // namespace palpate

// Tracks several contacts from frame to frame, each with its own id, force and shear.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "engine/measure/force.h"
#include "engine/measure/motion/shear.h"
#include "engine/measure/motion/skin_motion.h"
#include "engine/numeric/assignment.h"
#include "palpate/sensor.h"
#include "palpate/touch.h"

namespace palpate {

/// Matches the regions of a frame to the contacts of the frame before. A region without a match starts a new
/// contact if it has at least smallest_contact_px(); an existing contact continues in a region of half that
/// size, so that one near the threshold does not flicker. The assignment continues as many contacts as
/// possible, with the least sum of squared displacements. A centroid may move by at most twice the larger
/// radius (of a circle of the contact's area) plus 4 px a frame. When two contacts merge, the id of the
/// nearer centroid continues, which is usually the larger contact's; the same when one splits. A contact that
/// is missing for at most kHeldFrames frames keeps its id and its onset. At most kMostContacts are tracked,
/// the largest.
class ContactTracker {
 public:
  static constexpr uint32_t kHeldFrames = 3;
  static constexpr uint32_t kMostContacts = 64;

  ContactTracker(const Sensor& sensor, const FrameFormat& format);

  /// The next frame does not continue the last one: all contacts end, and those of the next frame have an
  /// unseen onset.
  void interrupt();

  /// Frames in order. In: touch.contacts are the frame's regions with their shapes, in a fixed order. Where
  /// the caller knows that a region continues one of the frame before, both have the same lineage as their
  /// id, and the contact continues there at any distance. Out:
  /// the contacts, with ids, forces and shears, and small_regions. Where there are several contacts the force
  /// of `touch` becomes the sum of theirs, where there is one or more the shear as well: no contact that
  /// comes or goes then looks like a motion. Where the skin is followed (`skin_sd_px`: of each of its points)
  /// each contact has its own part of it; Touch::skin is that of the one contact, and of several has counts
  /// only. Forces of an indented volume are the whole touch's only.
  void update(Touch& touch, std::span<const float> skin_sd_px = {});

 private:
  struct Track {
    ContactTouch last;
    uint32_t missed = 0;   ///< frames since `last`
    uint32_t lineage = 0;  ///< of `last`, 0 where it is not known
    ForceHistory force;
    ShearTracker shear;
    SkinTracker skin;
    SkinMotion motion = {};  ///< in `last`
  };
  void choose(Touch& touch);
  void match();
  uint32_t nearest_of_lineage(const ContactTouch& region) const;
  Track& begin();
  void end_missing();
  void sum_skin(Touch& touch) const;
  void measure(Track& track, const Touch& touch, std::span<const float> skin_sd_px) const;
  void add_up(Touch& touch) const;

  Sensor sensor_;
  uint64_t smallest_px_;
  uint32_t last_id_ = 0;
  bool interrupted_ = false;
  std::vector<Track> tracks_;  // rising id
  // State of the present frame; kept so that frames allocate nothing.
  std::vector<ContactTouch> regions_, chosen_;
  std::vector<uint32_t> largest_;
  std::vector<uint32_t> track_of_;  // of each region, or kNoTrack
  std::vector<double> cost_;
  Assignment assignment_;
  std::vector<SkinTracker> spare_skins_;  // of contacts that have ended
};

}  // namespace palpate

// Contact settings of a sensor file from presses at known places: what a touch changes, and what noise does.
#pragma once

#include <string>

#include "capture/calibrate/photometric/presses.h"

namespace palpate {

struct PressContact {
  Signal signal = Signal::Either;
  double brighter = 0;             ///< fraction of the change within contacts that is upwards, 0 to 1
  double contact_gray = 0;         ///< median filtered change within contacts, by `signal`
  double rest_gray = 0;            ///< filtered change that 99.9 % of the pixels far from contacts stay below
  double threshold_gray = 0;       ///< from that, in steps of 1/128
  double contact_gray_per_px = 0;  ///< median steepness of the change within contacts
  double gradient_gray_per_px = 0;  ///< that 99.9 % of the pixels far from contacts stay below, likewise
  bool clear = true;                ///< contacts change by more than the threshold
};

/// Presses need a frame, its background, a centre and a contact radius. Signal: brighter or darker where nine
/// tenths of the change go that way. Pixels from three contact radii on count as untouched, printed markers
/// not at all.
PressContact contact_of_presses(const BallPresses& found, Filter filter);

/// Puts signal, threshold and steepness into the sensor.
void apply(const PressContact& contact, Sensor& sensor);

/// "contact: either way, median change 38.2 gray; untouched 99.9 % below 6.1 gray: threshold 9.2 gray ...";
/// lines without an end.
std::string describe(const PressContact& contact);

}  // namespace palpate

// Estimate: a number with its standard error and how far it may be trusted.
#pragma once

#include <cstdint>

#include "palpate/export.h"

namespace palpate {

/// How far a number may be trusted. Shown to the user with the number, never dropped.
enum class Validity : uint8_t {
  Valid,
  NotCalibrated,  ///< the sensor file has no calibration for this quantity
  NoContact,      ///< nothing touches the pad, the quantity has no meaning
  BelowRange,     ///< smaller than anything seen in calibration
  AboveRange,     ///< larger than anything seen in calibration
  Saturated,      ///< pixels are at the camera's limit (see saturated_px): the value may be too low
  AtBorder,       ///< the contact reaches the frame's border: what presses outside is missing
  Clipped,        ///< much of the contact is steeper than max_slope (see clipped_px): depths are too low
  Extrapolated,   ///< much of the contact has colours, or lies at places, that calibration never saw
  OnsetUnseen,    ///< the contact began while no frames came: shear counts from where it was first seen
  Apart,          ///< unknown pixels cut the known ones into islands: heights between them are not determined
  Covered,        ///< printed markers hide too much of the skin: the surface under them is not known
  ShapeUnjudged,  ///< the calibration is of too few objects to tell what one of another shape gives
  Unfit,          ///< the calibration itself says that it is not fit for use
  TooDeep,        ///< of forces: than two thirds of the pad; of depths: than the pad itself
  NotConverged,   ///< the solve ended before it reached its tolerance
  LightUnknown,   ///< too little of a gel's frame agrees on one light: no change can be called a slope
  NotFollowed,    ///< separate pictures: what needs the frames before is not known
  Undetermined,   ///< no surface of this shape shows it: a ball's turns, a plane's shifts along itself
  PictureDamaged,  ///< the picture was spoilt on its way (Touch::picture): nothing was measured
};
PALPATE_API const char* to_string(Validity validity);

/// A value with its standard error (one sigma, same unit).
struct Estimate {
  double value = 0;
  double standard_error = 0;
  Validity validity = Validity::NotCalibrated;

  bool valid() const { return validity == Validity::Valid; }
};

}  // namespace palpate

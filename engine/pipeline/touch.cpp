#include "palpate/touch.h"

namespace palpate {

const char* to_string(Validity validity) {
  switch (validity) {
    case Validity::Valid:
      return "valid";
    case Validity::NotCalibrated:
      return "not calibrated";
    case Validity::NoContact:
      return "no contact";
    case Validity::BelowRange:
      return "below calibrated range";
    case Validity::AboveRange:
      return "above calibrated range";
    case Validity::Saturated:
      return "saturated";
    case Validity::AtBorder:
      return "reaches the border";
    case Validity::Clipped:
      return "slopes clipped";
    case Validity::Extrapolated:
      return "extrapolated";
    case Validity::OnsetUnseen:
      return "onset unseen";
    case Validity::Apart:
      return "apart";
    case Validity::Covered:
      return "covered";
    case Validity::ShapeUnjudged:
      return "other shapes not judged";
    case Validity::Unfit:
      return "calibration not fit for use";
    case Validity::TooDeep:
      return "too deep for the pad";
    case Validity::NotConverged:
      return "not converged";
    case Validity::LightUnknown:
      return "light unknown";
    case Validity::NotFollowed:
      return "not followed";
    case Validity::Undetermined:
      return "not determined";
    case Validity::PictureDamaged:
      return "picture damaged";
  }
  return "?";
}

const char* to_string(PoseState state) {
  switch (state) {
    case PoseState::NoContact:
      return "no contact";
    case PoseState::Begun:
      return "begun";
    case PoseState::Tracked:
      return "tracked";
    case PoseState::Lost:
      return "lost";
    case PoseState::PictureDamaged:
      return "picture damaged";
  }
  return "?";
}

const char* to_string(PoseLoss loss) {
  switch (loss) {
    case PoseLoss::None:
      return "none";
    case PoseLoss::LittleOverlap:
      return "little overlap";
    case PoseLoss::LargeResidual:
      return "large residual";
    case PoseLoss::ManyStrangers:
      return "many strangers";
    case PoseLoss::LargeStep:
      return "large step";
    case PoseLoss::SlopesDisagree:
      return "slopes disagree";
  }
  return "?";
}

const char* to_string(PoseDoubt doubt) {
  switch (doubt) {
    case PoseDoubt::None:
      return "none";
    case PoseDoubt::OthersMove:
      return "others move";
    case PoseDoubt::ShapeChanges:
      return "shape changes";
    case PoseDoubt::FitsElsewhere:
      return "fits elsewhere";
  }
  return "?";
}

const char* to_string(OnSkin on_skin) {
  switch (on_skin) {
    case OnSkin::Unknown:
      return "unknown";
    case OnSkin::Sticks:
      return "sticks";
    case OnSkin::Slips:
      return "slips";
    case OnSkin::Disagrees:
      break;
  }
  return "disagrees";
}

const char* to_string(Slippage kind) {
  switch (kind) {
    case Slippage::None:
      return "none";
    case Slippage::Ball:
      return "ball";
    case Slippage::Plane:
      return "plane";
    case Slippage::Cylinder:
      return "cylinder";
    case Slippage::Revolution:
      return "revolution";
    case Slippage::Extrusion:
      return "extrusion";
    case Slippage::Screw:
      return "screw";
    case Slippage::Other:
      return "other";
  }
  return "?";
}

const char* to_string(LightState state) {
  switch (state) {
    case LightState::Steady:
      return "steady";
    case LightState::Changed:
      return "changed";
    case LightState::Unknown:
      return "unknown";
  }
  return "?";
}

const char* to_string(Slip slip) {
  switch (slip) {
    case Slip::NoContact:
      return "no contact";
    case Slip::Stick:
      return "stick";
    case Slip::Slip:
      return "slip";
    case Slip::Incipient:
      return "incipient slip";
    case Slip::NotCalibrated:
      return "not calibrated";
    case Slip::PictureDamaged:
      return "picture damaged";
  }
  return "?";
}

const char* to_string(PictureFault fault) {
  switch (fault) {
    case PictureFault::None:
      return "whole";
    case PictureFault::OneColour:
      return "a part in one colour";
    case PictureFault::ColourOrder:
      return "colours exchanged";
    case PictureFault::Moved:
      return "rolled around or doubled";
    case PictureFault::Torn:
      return "torn";
  }
  return "?";
}

}  // namespace palpate

// The groups of measured quantities, and those that a sensor with its outputs can fill.
#pragma once

#include <cstdint>

#include "palpate/options.h"
#include "palpate/sensor.h"

namespace palpate {

/// The columns of a table: those that its sensor and outputs can fill.
struct MeasuredColumns {
  enum Group : uint32_t {
    Frame = 1 << 0,   ///< its number: always
    Time = 1 << 1,    ///< not of images without a rate
    Source = 1 << 2,  ///< the file of each frame, where every frame has one
    Touching = 1 << 3,
    Force = 1 << 4,
    Shear = 1 << 5,
    Slipping = 1 << 6,
    Millimetres = 1 << 7,
    Pixels = 1 << 8,  ///< lengths, where no scale is known
    Depth = 1 << 9,
    DepthError = 1 << 10,
    Confidence = 1 << 11,
    Weighted = 1 << 12,
    Contacts = 1 << 13,
    Skin = 1 << 14,
    Gradient = 1 << 15,
    Light = 1 << 16,
    Traction = 1 << 17,
    ShiftMillimetres = 1 << 18,  ///< since a contact's onset: not of separate pictures
    ShiftPixels = 1 << 19,       ///< the same, where no scale is known
    Dented = 1 << 20,
    Extrapolated = 1 << 21,
    Object = 1 << 22,
    Truth = 1 << 23,
  };
  /// All that a sensor with a scale could fill, without truth and source.
  static constexpr uint32_t kAll =
      (Truth - 1) & ~uint32_t{Source} & ~uint32_t{Pixels} & ~uint32_t{ShiftPixels};
  /// Those of the force output, alone and of each contact.
  static constexpr uint32_t kOfTouch =
      Touching | Force | Shear | Slipping | Millimetres | Pixels | ShiftMillimetres | ShiftPixels;

  uint32_t groups = kAll;

  /// `outputs` and `separate`: as in PipelineOptions. Time is there, Source and Truth are not.
  static MeasuredColumns of(const Sensor& sensor, Outputs outputs, bool separate = false);
  MeasuredColumns with(Group group, bool there) const {
    return {there ? groups | group : groups & ~uint32_t{group}};
  }
};

}  // namespace palpate

// Object pose: where the object that touches the pad has moved (Output::Motion), and what of it is not known.
#pragma once

#include <array>
#include <cstdint>

#include "palpate/estimate.h"
#include "palpate/export.h"

namespace palpate {

enum class PoseState : uint8_t {
  NoContact,  ///< too little of it
  Begun,      ///< a track's first frame: every motion is 0 by definition
  Tracked,
  Lost,            ///< PoseLoss says why; the next frame begins a new track
  PictureDamaged,  ///< not known: see Touch::picture
};
PALPATE_API const char* to_string(PoseState state);

enum class PoseLoss : uint8_t {
  None,
  LittleOverlap,   ///< with the key frame
  LargeResidual,   ///< a multiple of that of the frames before
  ManyStrangers,   ///< pixels that do not fit
  LargeStep,       ///< by a third of the contact in one frame
  SlopesDisagree,  ///< both frames' slopes: the search ended on another wave of a texture
};
PALPATE_API const char* to_string(PoseLoss loss);

/// Doubt: what a tracked pose is to be taken with care for.
enum class PoseDoubt : uint8_t {
  None,
  OthersMove,    ///< several contacts that move unlike: the pose is the largest one's
  ShapeChanges,  ///< two frames on end left twice the residual of calm ones: no rigid object on a calm pad
  /// The surface repeats: it fits nearly as well a wave or more from there, by what an object may move in a
  /// frame. No error states that.
  FitsElsewhere,
};
PALPATE_API const char* to_string(PoseDoubt doubt);

/// Surfaces that slide along themselves (Gelfand and Guibas, Shape Segmentation Using Local Slippage
/// Analysis, 2004), by what may be done to them unseen.
enum class Slippage : uint8_t {
  None,        ///< the surface determines all six
  Ball,        ///< turns about its centre
  Plane,       ///< two shifts along it, and its turn about the third
  Cylinder,    ///< shift along its axis and turn about it
  Revolution,  ///< turn about its axis
  Extrusion,   ///< shift along a line
  Screw,       ///< both at once about an axis
  Other,
};
PALPATE_API const char* to_string(Slippage kind);

/// Object and skin, where the skin is followed (Output::Skin), by how far both have moved since they last
/// stuck.
enum class OnSkin : uint8_t {
  Unknown,  ///< no shift along the pad is known of both
  Sticks,   ///< they move alike, within their errors (95 %)
  Slips,    ///< the object goes on where the skin stays behind
  /// The skin goes farther than the object, across its way or back (99 %): the object's texture is the skin's
  /// or the pad's, a wave was missed, or the skin's points were lost.
  Disagrees
};
PALPATE_API const char* to_string(OnSkin on_skin);

/// Places count from the picture's middle: x to the right, y down, z into the pad. Of the object's point that
/// is at `at_mm` now: its shifts since the track began, and the object's turns about the axes, as a rotation
/// vector. Components that the surface does not determine have the state Undetermined and no number.
struct ObjectPose {
  PoseState state = PoseState::NoContact;
  PoseLoss loss = PoseLoss::None;
  PoseDoubt doubt = PoseDoubt::None;
  uint32_t track = 0;                  ///< counts from 1; a new one begins after a loss or without contact
  uint32_t keys = 0;                   ///< key frames of the track so far
  Slippage surface = Slippage::None;   ///< what the contact is now
  std::array<double, 3> at_mm{};       ///< the middle of the contact
  std::array<Estimate, 3> shift_mm{};  ///< x, y, z
  std::array<Estimate, 3> turn_rad{};  ///< about x, y, z
  /// Of the small motion about at_mm that is missing: three shifts, mm, and three turns, rad; rows. 0 along
  /// what is not determined.
  std::array<double, 36> covariance{};
  /// The motion itself, x -> rotation x + translation_mm, rows; of those that what is not determined leaves
  /// open, the one that turns least.
  std::array<double, 9> rotation{1, 0, 0, 0, 1, 0, 0, 0, 1};
  std::array<double, 3> translation_mm{};
  OnSkin on_skin = OnSkin::Unknown;
  /// How far the object has slid over the skin since they last stuck, x and y.
  std::array<Estimate, 2> slip_mm{};
  double residual_mm = 0;  ///< that the motion leaves between both surfaces, a standard deviation
  double overlap = 0;      ///< part of the contact that is compared with the key frame's, 0 to 1
};

}  // namespace palpate

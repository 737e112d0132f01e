// Common part of the finders of balls in colour and in gray gels: the change that a press makes, and why
// a picture is no press of one ball.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "engine/calibrate/ball/shape.h"
#include "palpate/frame.h"

namespace palpate {

/// Why a picture is no press of one ball.
enum class BallRefusal {
  None,         ///< it is one
  Untouched,    ///< nothing is pressed
  TooSmall,     ///< the contact is too small to measure
  AtBorder,     ///< the contact reaches the frame's border
  TooWide,      ///< the contact is wider than the ball: its radius or the scale is wrong, or another object
  Covered,      ///< too much is saturated, black or under markers
  MoreThanOne,  ///< something else is pressed too, or what is pressed is no ball
  Unlike,       ///< it changes the picture unlike the other presses: another ball
  Foreign       ///< the picture is of another pad or light than the untouched image
};

/// Contact of a ball or of another shape, px of the rectified frame. With a refusal the numbers are what the
/// search ended with.
struct FoundBall {
  double center_x_px = 0;
  double center_y_px = 0;
  double radius_px = 0;  ///< of the contact, where the pad leaves the ball; half the width along a cylinder
  double center_sd_px = 0;  ///< standard error along x or y, from the fit's residuals
  double radius_sd_px = 0;
  double axis_rad = 0;        ///< direction of a cylinder's axis, from x towards y
  double half_length_px = 0;  ///< of the contact along a cylinder; 0: a round contact
  double explained = 0;       ///< fraction of the change around the contact that one ball explains, 0 to 1
  double ramp_per_px = 0;     ///< colour: how fast the change grows across the contact, over the untouched
                              ///< brightness there, for a lamp shines on both: much alike for one ball
  BallRefusal why = BallRefusal::None;
  std::string refusal;  ///< the same in words; empty: it is a press of one ball

  bool good() const { return why == BallRefusal::None; }
  void refuse(BallRefusal because, std::string words) {
    why = because;
    refusal = std::move(words);
  }
};

/// Pixel as the contact's middle sees it.
struct MiddleOffset {
  double dx_px = 0, dy_px = 0;  ///< from the nearest point of the middle
  double px = 0;        ///< their length; beyond an end of a cylinder the distance from the contact's axis
  bool at_end = false;  ///< near an end of a cylinder or beyond: the slope there is not known
};
MiddleOffset offset_from(const FoundBall& contact, double x_px, double y_px);

/// Pixels of a contact whose slopes are known, up to a half width of `half_px`.
double known_px(const FoundBall& contact, double half_px);

/// Part along the pad, x and y, of the inward normal at an offset of a pad that follows the shape.
std::array<double, 2> normal_at(const PressedShape& shape, const MiddleOffset& offset,
                                double pitch_mm_per_px);

struct BallSearch {
  PressedShape shape{};
  double pitch_mm_per_px = 0;
  double threshold_gray = 0;  ///< least filtered change that counts as touch; 0: from the picture's noise
  double least_in_frame = 1;  ///< share of the contact that must lie in the frame
};

namespace ball {

inline constexpr double kLeastExplained = 0.75;  ///< of the change around the contact
inline constexpr double kSecondContact = 0.25;   ///< change outside over the ball's own, both summed squares
inline constexpr double kClearlyBetter = 0.7;    ///< of what one shape leaves of the change, by another
inline constexpr double kLeastRadius_px = 4;
inline constexpr double kLargestContact = 0.98;  ///< over the radius of the ball or cylinder

/// The change of a frame from the background, box means of 5 x 5 pixels that leave out what is masked.
struct Change {
  int width = 0, height = 0;
  std::array<std::vector<float>, 3> smooth;  ///< per channel; 0 where nothing is known
  std::vector<float> size2;                  ///< squared length over the channels
  uint32_t channels = 0;
};
Change change_of(const Frame& frame, const Frame& background, std::span<const uint8_t> mask);

/// Throws Error(Failure::Input) where the two do not go together, or with the mask.
void check_pair(const Frame& frame, const Frame& background, uint32_t channels,
                std::span<const uint8_t> mask);

/// Refuses a contact that cannot be the shape's.
void check_contact(FoundBall& ball, const FrameFormat& format, const BallSearch& search);
/// Refuses a contact of which too little can be used.
void check_coverage(FoundBall& ball, const Frame& frame, const Frame& background,
                    std::span<const uint8_t> mask);

/// "12 %", "3.4".
std::string percent(double fraction);
std::string tenths(double value);

}  // namespace ball
}  // namespace palpate

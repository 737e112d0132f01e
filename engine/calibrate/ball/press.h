// Common part of the finders of balls in colour and in gray gels: the change that a press makes, and why
// a picture is no press of one ball.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

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

/// A ball's contact, px of the rectified frame. With a refusal the numbers are what the search ended with.
struct FoundBall {
  double center_x_px = 0;
  double center_y_px = 0;
  double radius_px = 0;     ///< of the contact, where the pad leaves the ball
  double center_sd_px = 0;  ///< standard error along x or y, from the fit's residuals
  double radius_sd_px = 0;
  double explained = 0;    ///< fraction of the change around the contact that one ball explains, 0 to 1
  double ramp_per_px = 0;  ///< colour: how fast the change grows across the contact, over the untouched
                           ///< brightness there, for a lamp shines on both: much alike for one ball
  BallRefusal why = BallRefusal::None;
  std::string refusal;  ///< the same in words; empty: it is a press of one ball

  bool good() const { return why == BallRefusal::None; }
  void refuse(BallRefusal because, std::string words) {
    why = because;
    refusal = std::move(words);
  }
};

struct BallSearch {
  double ball_radius_mm = 0;
  double pitch_mm_per_px = 0;
  double threshold_gray = 0;  ///< least filtered change that counts as touch; 0: from the picture's noise
  double least_in_frame = 1;  ///< share of the contact that must lie in the frame
};

namespace ball {

inline constexpr double kLeastExplained = 0.75;  ///< of the change around the contact
inline constexpr double kSecondContact = 0.25;   ///< change outside over the ball's own, both summed squares
inline constexpr double kLeastRadius_px = 4;
inline constexpr double kLargestContact = 0.98;  ///< contact over ball radius

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

/// Refuses a circle that cannot be the contact of the ball.
void check_circle(FoundBall& ball, const FrameFormat& format, const BallSearch& search);
/// Refuses a contact of which too little can be used.
void check_coverage(FoundBall& ball, const Frame& frame, const Frame& background,
                    std::span<const uint8_t> mask);

/// "12 %", "3.4".
std::string percent(double fraction);
std::string tenths(double value);

}  // namespace ball
}  // namespace palpate

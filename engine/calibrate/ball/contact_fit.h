// Fit of a shape's slopes to the change of colour in and around its contact.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "engine/calibrate/ball/press.h"
#include "palpate/frame.h"

namespace palpate::ball {

inline constexpr double kWindow = 2.2;  ///< half widths around the middle that a fit looks at

/// Slope of the pad in and around a contact over that at its rim, by four unknowns: the contact's place in
/// two numbers, the logarithm of its half width (px), and that of the way in half widths over which the pad
/// goes back faster than a half space does.
struct SlopeModel {
  PressedShape::Kind kind = PressedShape::Kind::Ball;
  double tip_px = 0;  ///< of a cone: where its rounded tip ends
  /// Of a cylinder, whose place is the distance of its axis from the pivot, and its turn from `axis_rad`
  /// times `reach_px`, both in px. Round contacts have their centre.
  double pivot_x_px = 0, pivot_y_px = 0, axis_rad = 0, reach_px = 1;

  struct At {
    double dx = 0, dy = 0, r = 0, along = 0;  ///< px; a cylinder has its signed distance in dx
  };
  At at(const Eigen::Vector4d& unknowns, double x, double y) const;
  /// What the change is linear in: a constant, the slope in two parts, and its square.
  Eigen::Vector4d basis(const At& at, double radius_px, double decay) const;
};

struct Sample {
  double x, y;
  Eigen::Vector3d change;
};
/// Pixels in a box that `wanted` wants, so thinned that a few thousand remain; saturated ones are left out.
struct SampleBox {
  double x_px, y_px, reach_x_px, reach_y_px;
};
std::vector<Sample> samples_in(const Frame& frame, const Frame& background, std::span<const uint8_t> mask,
                               const SampleBox& box, const std::function<bool(double, double)>& wanted);

struct ContactFit {
  Eigen::Vector4d at;                             // the unknowns
  Eigen::Matrix<double, 4, 3> linear;             // rows as SlopeModel::basis
  Eigen::Matrix<double, Eigen::Dynamic, 3> left;  // residuals, not weighted
  double cost = 0;
  Eigen::Matrix4d normal = Eigen::Matrix4d::Identity();
  std::vector<Sample> samples;
  std::vector<double> weights;

  bool enough() const { return samples.size() >= 60; }
};
/// Levenberg-Marquardt over the unknowns, what is linear is solved for inside it; robust weights. `choose`
/// gives the pixels around a contact and is asked anew from round to round.
ContactFit fit_contact(const SlopeModel& model, const Eigen::Vector4d& start, double largest_px,
                       const std::function<std::vector<Sample>(const Eigen::Vector4d&)>& choose);

/// Of a round contact, to pixels up to kWindow radii from its centre, and no farther than `most_px`.
ContactFit fit_round(const Frame& frame, const Frame& background, std::span<const uint8_t> mask,
                     const SlopeModel& model, const Eigen::Vector4d& start, double most_px);

/// Fills what the model leaves of the change, how fast that grows, and the standard errors that follow.
void judge_fit(const ContactFit& fit, const SlopeModel& model, const Frame& background, FoundBall& found);

/// A picture of a press in colour, before its contact is looked for.
struct PressedPicture {
  Change change;
  double level2 = 0;  ///< squared change above which a pixel counts
  FoundBall found;    ///< refused where nothing is pressed
};
/// Throws as check_pair().
PressedPicture pressed_picture(const Frame& frame, const Frame& background, std::span<const uint8_t> mask,
                               const BallSearch& search);
/// Refuses what the shape does not explain, what has something else next to it, and what cannot be the
/// shape's.
void check_fit(FoundBall& found, const Change& change, double level2, const Frame& frame,
               const Frame& background, std::span<const uint8_t> mask, const BallSearch& search);

}  // namespace palpate::ball

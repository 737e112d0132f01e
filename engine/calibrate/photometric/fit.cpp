#include "engine/calibrate/photometric/fit.h"

#include <algorithm>
#include <cmath>

#include "engine/calibrate/photometric/press.h"
#include "palpate/error.h"

namespace palpate {
namespace {

using photometric::Pixel;

static_assert(kFollowedShares.front() == PhotometricFit::kJudgedShare);

bool linear_range(const Frame& a, const Frame& b, uint32_t x, uint32_t y, uint32_t full) {
  for (uint32_t c = 0; c < 3; ++c) {
    const uint32_t p = a.at(c, x, y), q = b.at(c, x, y);
    if (p == 0 || q == 0 || p >= full || q >= full) return false;
  }
  return true;
}

Pixel pixel_at(const Frame& frame, const Frame& background, uint32_t x, uint32_t y) {
  const FrameFormat& f = frame.format;
  Pixel pixel{{}, (2.0 * x + 1) / f.width - 1, (2.0 * y + 1) / f.height - 1};
  for (uint32_t c = 0; c < 3; ++c)
    pixel.change[c] =
        (static_cast<double>(frame.at(c, x, y)) - static_cast<double>(background.at(c, x, y))) / f.max_gray();
  return pixel;
}

}  // namespace

PhotometricFit::PhotometricFit(const FrameFormat& format, double pitch_mm_per_px)
    : format_(format), pitch_mm_per_px_(pitch_mm_per_px) {
  if (format.channels != 3)
    throw Error(Failure::Input, "three colour channels for a photometric fit",
                std::to_string(format.channels) + " channel", "a sensor file with \"channels\": 3");
  if (!(pitch_mm_per_px > 0) || !std::isfinite(pitch_mm_per_px))
    throw Error(Failure::Input, "a positive pitch in mm per px", std::to_string(pitch_mm_per_px),
                "setting pitch_mm_per_px in the sensor file");
}

PhotometricFit::~PhotometricFit() = default;
PhotometricFit::PhotometricFit(PhotometricFit&&) noexcept = default;
PhotometricFit& PhotometricFit::operator=(PhotometricFit&&) noexcept = default;

namespace {
void check_shapes(const FrameFormat& wanted, const Frame& frame, const Frame& background,
                  const std::string& label) {
  if (!(frame.format == wanted) || !(background.format == wanted))
    throw Error(Failure::Input, "press and background images of one format", "different ones for " + label,
                "images of the same camera and sensor file");
}
}  // namespace

void PhotometricFit::add_normals(const Frame& frame, const Frame& background,
                                 std::span<const double> normal_x, std::span<const double> normal_y,
                                 const std::string& label) {
  check_shapes(format_, frame, background, label);
  const size_t pixels = size_t{format_.width} * format_.height;
  if (normal_x.size() != pixels || normal_y.size() != pixels)
    throw Error(Failure::Input, std::to_string(pixels) + " normals", std::to_string(normal_x.size()),
                "one normal for each pixel of " + label);
  PhotometricPress press;
  press.label = label;
  for (uint32_t y = 0; y < format_.height; ++y)
    for (uint32_t x = 0; x < format_.width; ++x) {
      const size_t i = size_t{y} * format_.width + x;
      if (std::isnan(normal_x[i]) || std::isnan(normal_y[i])) continue;
      if (linear_range(frame, background, x, y, format_.max_gray()))
        press.add(pixel_at(frame, background, x, y), normal_x[i], normal_y[i]);
    }
  presses_.push_back(std::move(press));
}

void PhotometricFit::add_ball(const Frame& frame, const Frame& background, double cx_px, double cy_px,
                              double contact_radius_px, double ball_radius_mm, const std::string& label,
                              std::span<const uint8_t> mask) {
  check_shapes(format_, frame, background, label);
  if (!mask.empty() && mask.size() != size_t{format_.width} * format_.height)
    throw Error(Failure::Input, "a mask of the frame's size", std::to_string(mask.size()) + " values",
                "one value for each pixel of " + label);
  const double contact_radius_mm = contact_radius_px * pitch_mm_per_px_;
  if (!(contact_radius_px >= 2) || !(contact_radius_mm < ball_radius_mm) || !std::isfinite(ball_radius_mm))
    throw Error(Failure::Input, "a contact of 2 px or more that is smaller than its ball",
                "contact radius " + std::to_string(contact_radius_mm) + " mm on a ball of radius " +
                    std::to_string(ball_radius_mm) + " mm for " + label,
                "checking the pitch of the sensor file and the radii");
  PhotometricPress press;
  press.label = label;
  PhotometricPress::Ball& ball = press.ball;
  const auto bound = [](double v, uint32_t side) {
    return static_cast<uint32_t>(std::clamp(v, 0.0, static_cast<double>(side)));
  };
  const uint32_t x0 = bound(std::floor(cx_px - contact_radius_px), format_.width);
  const uint32_t x1 = bound(std::ceil(cx_px + contact_radius_px) + 1, format_.width);
  const uint32_t y0 = bound(std::floor(cy_px - contact_radius_px), format_.height);
  const uint32_t y1 = bound(std::ceil(cy_px + contact_radius_px) + 1, format_.height);
  ball.radius_mm = ball_radius_mm;
  ball.center_x_px = cx_px;
  ball.center_y_px = cy_px;
  ball.contact_px = contact_radius_px;
  ball.width = x1 > x0 ? x1 - x0 : 0;
  ball.inside.assign(size_t{ball.width} * (y1 > y0 ? y1 - y0 : 0), 0);

  const double known_px = kJudgedShare * contact_radius_px, known_mm = kJudgedShare * contact_radius_mm;
  const double rim_mm = std::sqrt(ball_radius_mm * ball_radius_mm - known_mm * known_mm);
  for (uint32_t y = 0; y < format_.height; ++y)
    for (uint32_t x = 0; x < format_.width; ++x) {
      const double dx = x - cx_px, dy = y - cy_px, r = std::hypot(dx, dy);
      if (r >= kFollowedShares.back() * contact_radius_px && r < kRestRing * contact_radius_px) continue;
      if (!mask.empty() && mask[size_t{y} * format_.width + x]) continue;
      if (!linear_range(frame, background, x, y, format_.max_gray())) continue;
      const Pixel pixel = pixel_at(frame, background, x, y);
      if (r >= kRestRing * contact_radius_px) {
        press.rest.add(pixel, 0, 0);
        continue;
      }
      const double to_normal = -pitch_mm_per_px_ / ball_radius_mm;
      size_t share = 0;
      while (r >= kFollowedShares[share] * contact_radius_px) ++share;
      if (share > 0) {
        press.contact[share].add(pixel, to_normal * dx, to_normal * dy);
        continue;
      }
      press.add(pixel, to_normal * dx, to_normal * dy);
      const double r_mm = r * pitch_mm_per_px_;
      ball.inside[size_t{y - y0} * ball.width + (x - x0)] = 1;
      ball.depth_mm.push_back(std::sqrt(ball_radius_mm * ball_radius_mm - r_mm * r_mm) - rim_mm);
    }
  const double disc_px = 3.14159265358979 * known_px * known_px;
  if (press.contact.front().weight < 0.5 * disc_px)
    throw Error(
        Failure::Input, "half of the contact or more in the frame, neither black nor saturated",
        std::to_string(static_cast<int>(100 * press.contact.front().weight / disc_px)) + " % for " + label,
        "checking its centre and radius (px of the rectified frame)");
  press.rest_factor = std::min(1.0, press.contact.front().weight / std::max(press.rest.weight, 1.0));
  presses_.push_back(std::move(press));
}

}  // namespace palpate

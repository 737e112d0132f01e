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
  FoundBall contact;
  contact.center_x_px = cx_px;
  contact.center_y_px = cy_px;
  contact.radius_px = contact_radius_px;
  add_press(frame, background, contact, PressedShape::ball(ball_radius_mm), label, mask);
}

void PhotometricFit::add_press(const Frame& frame, const Frame& background, const FoundBall& contact,
                               const PressedShape& shape, const std::string& label,
                               std::span<const uint8_t> mask) {
  check_shapes(format_, frame, background, label);
  if (!mask.empty() && mask.size() != size_t{format_.width} * format_.height)
    throw Error(Failure::Input, "a mask of the frame's size", std::to_string(mask.size()) + " values",
                "one value for each pixel of " + label);
  const double half_px = contact.radius_px, half_mm = half_px * pitch_mm_per_px_;
  const bool finite = std::isfinite(shape.radius_mm) && std::isfinite(contact.half_length_px);
  if (!(half_px >= 2) || !(half_mm < shape.widest_mm()) || !finite)
    throw Error(Failure::Input,
                std::string("a contact of 2 px or more that is smaller than its ") + name_of(shape.kind),
                "contact radius " + std::to_string(half_mm) + " mm on " + describe(shape) + " for " + label,
                "checking the pitch of the sensor file and the radii");
  PhotometricPress press;
  press.label = label;
  press.truth = PhotometricPress::Truth{};
  PhotometricPress::Truth& truth = *press.truth;
  truth.shape = shape;
  truth.contact = contact;
  const auto bound = [](double v, uint32_t side) {
    return static_cast<uint32_t>(std::clamp(v, 0.0, static_cast<double>(side)));
  };
  const double along_px = contact.half_length_px,
               reach_x_px = half_px + std::abs(along_px * std::cos(contact.axis_rad)),
               reach_y_px = half_px + std::abs(along_px * std::sin(contact.axis_rad));
  const uint32_t x0 = bound(std::floor(contact.center_x_px - reach_x_px), format_.width);
  const uint32_t x1 = bound(std::ceil(contact.center_x_px + reach_x_px) + 1, format_.width);
  const uint32_t y0 = bound(std::floor(contact.center_y_px - reach_y_px), format_.height);
  const uint32_t y1 = bound(std::ceil(contact.center_y_px + reach_y_px) + 1, format_.height);
  truth.left_px = x0;
  truth.top_px = y0;
  truth.width = x1 > x0 ? x1 - x0 : 0;
  truth.inside.assign(size_t{truth.width} * (y1 > y0 ? y1 - y0 : 0), 0);

  const double rim_mm = shape.height_mm(kJudgedShare * half_mm);
  for (uint32_t y = 0; y < format_.height; ++y)
    for (uint32_t x = 0; x < format_.width; ++x) {
      const MiddleOffset offset = offset_from(contact, x, y);
      const bool rest = offset.px >= kRestRing * half_px;
      if (!rest && (offset.at_end || offset.px >= kFollowedShares.back() * half_px)) continue;
      if (!mask.empty() && mask[size_t{y} * format_.width + x]) continue;
      if (!linear_range(frame, background, x, y, format_.max_gray())) continue;
      const Pixel pixel = pixel_at(frame, background, x, y);
      if (rest) {
        press.rest.add(pixel, 0, 0);
        continue;
      }
      const std::array<double, 2> normal = normal_at(shape, offset, pitch_mm_per_px_);
      size_t share = 0;
      while (offset.px >= kFollowedShares[share] * half_px) ++share;
      if (share > 0) {
        press.contact[share].add(pixel, normal[0], normal[1]);
        continue;
      }
      press.add(pixel, normal[0], normal[1]);
      truth.inside[size_t{y - y0} * truth.width + (x - x0)] = 1;
      truth.depth_mm.push_back(shape.height_mm(offset.px * pitch_mm_per_px_) - rim_mm);
    }
  const double all_px = known_px(contact, kJudgedShare * half_px);
  if (press.contact.front().weight < 0.5 * all_px)
    throw Error(
        Failure::Input, "half of the contact or more in the frame, neither black nor saturated",
        std::to_string(static_cast<int>(100 * press.contact.front().weight / all_px)) + " % for " + label,
        "checking its centre and radius (px of the rectified frame)");
  press.rest_factor = std::min(1.0, press.contact.front().weight / std::max(press.rest.weight, 1.0));
  presses_.push_back(std::move(press));
}

}  // namespace palpate

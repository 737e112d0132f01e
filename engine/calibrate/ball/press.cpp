#include "engine/calibrate/ball/press.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "engine/base/text.h"
#include "palpate/error.h"

namespace palpate {

MiddleOffset offset_from(const FoundBall& contact, double x_px, double y_px) {
  const double dx = x_px - contact.center_x_px, dy = y_px - contact.center_y_px;
  if (!(contact.half_length_px > 0)) return {dx, dy, std::hypot(dx, dy)};
  const double ux = std::cos(contact.axis_rad), uy = std::sin(contact.axis_rad), along = dx * ux + dy * uy;
  MiddleOffset offset{dx - along * ux, dy - along * uy};
  offset.px = std::hypot(offset.dx_px, offset.dy_px);
  // The pad goes down to an end within about a half width of it.
  offset.at_end = std::abs(along) > contact.half_length_px - contact.radius_px;
  if (const double beyond = std::abs(along) - contact.half_length_px; beyond > 0)
    offset.px = std::hypot(offset.px, beyond);
  return offset;
}

double known_px(const FoundBall& contact, double half_px) {
  if (!(contact.half_length_px > 0)) return std::numbers::pi * half_px * half_px;
  return 4 * half_px * (contact.half_length_px - contact.radius_px);
}

std::array<double, 2> normal_at(const PressedShape& shape, const MiddleOffset& offset,
                                double pitch_mm_per_px) {
  const bool side =
      shape.kind == PressedShape::Kind::Cone && offset.px * pitch_mm_per_px > shape.rounded_mm();
  if (!side && !(shape.radius_mm > 0)) return {};  // the point of a sharp cone
  const double per_px = side ? -shape.steepest() / offset.px : -pitch_mm_per_px / shape.radius_mm;
  return {per_px * offset.dx_px, per_px * offset.dy_px};
}

namespace ball {
namespace {

constexpr double kLeastSeen = 0.5;  // of the contact, neither masked nor black nor saturated: as a fit wants

bool within(const FoundBall& ball, uint32_t x, uint32_t y) {
  const MiddleOffset offset = offset_from(ball, x, y);
  return !offset.at_end && offset.px < ball.radius_px;
}

double share_in_frame(const FoundBall& ball, const FrameFormat& format) {
  double inside = 0;
  for (uint32_t y = 0; y < format.height; ++y)
    for (uint32_t x = 0; x < format.width; ++x) inside += within(ball, x, y);
  return inside / known_px(ball, ball.radius_px);
}

}  // namespace

Change change_of(const Frame& frame, const Frame& background, std::span<const uint8_t> mask) {
  const FrameFormat& f = frame.format;
  Change change;
  change.width = static_cast<int>(f.width);
  change.height = static_cast<int>(f.height);
  change.channels = f.channels;
  const size_t w = f.width, h = f.height;
  change.size2.assign(w * h, 0);
  constexpr size_t kReach = 2;
  std::vector<double> sums((w + 1) * (h + 1)), counts((w + 1) * (h + 1));
  for (uint32_t c = 0; c < f.channels; ++c) {
    change.smooth[c].assign(w * h, 0);
    for (size_t y = 0; y < h; ++y) {
      double row = 0, n = 0;
      for (size_t x = 0; x < w; ++x) {
        if (mask.empty() || !mask[y * w + x]) {
          const auto u = static_cast<uint32_t>(x), v = static_cast<uint32_t>(y);
          row += static_cast<double>(frame.at(c, u, v)) - static_cast<double>(background.at(c, u, v));
          n += 1;
        }
        sums[(y + 1) * (w + 1) + x + 1] = sums[y * (w + 1) + x + 1] + row;
        counts[(y + 1) * (w + 1) + x + 1] = counts[y * (w + 1) + x + 1] + n;
      }
    }
    for (size_t y = 0; y < h; ++y)
      for (size_t x = 0; x < w; ++x) {
        const size_t x0 = x >= kReach ? x - kReach : 0, x1 = std::min(w, x + kReach + 1);
        const size_t y0 = y >= kReach ? y - kReach : 0, y1 = std::min(h, y + kReach + 1);
        const auto box = [&](const std::vector<double>& t) {
          return t[y1 * (w + 1) + x1] - t[y0 * (w + 1) + x1] - t[y1 * (w + 1) + x0] + t[y0 * (w + 1) + x0];
        };
        const double n = box(counts);
        const auto mean = static_cast<float>(n > 0 ? box(sums) / n : 0);
        change.smooth[c][y * w + x] = mean;
        change.size2[y * w + x] += mean * mean;
      }
  }
  return change;
}

std::string percent(double fraction) {
  return std::to_string(static_cast<int>(std::lround(100 * fraction))) + " %";
}
std::string tenths(double value) {
  std::string text = std::to_string(std::round(value * 10) / 10);
  return text.substr(0, text.find('.') + 2);
}

void check_pair(const Frame& frame, const Frame& background, uint32_t channels,
                std::span<const uint8_t> mask) {
  if (!(frame.format == background.format) || frame.format.channels != channels)
    throw Error(Failure::Input,
                "a press and an untouched image of one format, " + std::to_string(channels) + " channels",
                std::to_string(frame.format.channels) + " and " + std::to_string(background.format.channels) +
                    " channels, or other sizes",
                "images of the same camera and sensor file");
  if (!mask.empty() && mask.size() != size_t{frame.format.width} * frame.format.height)
    throw Error(Failure::Input, "a mask of the frame's size", std::to_string(mask.size()) + " values",
                "one value for each pixel");
}

void check_contact(FoundBall& ball, const FrameFormat& format, const BallSearch& search) {
  const bool round = search.shape.round();
  if (ball.radius_px < kLeastRadius_px)
    return ball.refuse(BallRefusal::TooSmall, "a contact of " + tenths(ball.radius_px) + " px " +
                                                  (round ? "radius" : "half width") +
                                                  " is too small to measure");
  const double left = ball.center_x_px - ball.radius_px, top = ball.center_y_px - ball.radius_px;
  const bool cut = !round || left < 1 || top < 1 || ball.center_x_px + ball.radius_px > format.width - 2.0 ||
                   ball.center_y_px + ball.radius_px > format.height - 2.0;
  if (cut && (search.least_in_frame >= 1 || share_in_frame(ball, format) < search.least_in_frame))
    return ball.refuse(BallRefusal::AtBorder, "the contact reaches the frame's border");
  const double contact_mm = ball.radius_px * search.pitch_mm_per_px;
  if (contact_mm > kLargestContact * search.shape.widest_mm())
    ball.refuse(BallRefusal::TooWide,
                text("a contact of %.3g mm %s does not fit ", contact_mm, round ? "radius" : "half width") +
                    describe(search.shape) + ": its radius or the sensor's pitch is wrong");
}

void check_coverage(FoundBall& ball, const Frame& frame, const Frame& background,
                    std::span<const uint8_t> mask) {
  const FrameFormat& f = frame.format;
  double inside = 0, masked = 0, extreme = 0;
  for (uint32_t y = 0; y < f.height; ++y)
    for (uint32_t x = 0; x < f.width; ++x) {
      if (!within(ball, x, y)) continue;
      inside += 1;
      if (!mask.empty() && mask[size_t{y} * f.width + x]) {
        masked += 1;
        continue;
      }
      bool out = false;
      for (uint32_t c = 0; c < f.channels; ++c)
        for (const Frame* image : {&frame, &background})
          out = out || image->at(c, x, y) == 0 || image->at(c, x, y) >= f.max_gray();
      extreme += out;
    }
  const double all_px = known_px(ball, ball.radius_px);
  if (inside - masked - extreme >= kLeastSeen * all_px) return;
  ball.refuse(BallRefusal::Covered, percent(extreme / std::max(inside, 1.0)) +
                                        " of the contact is saturated or black, " +
                                        percent(masked / std::max(inside, 1.0)) + " covered by markers");
}

}  // namespace ball
}  // namespace palpate

#include "engine/map/key_frame.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "palpate/error.h"

namespace palpate {
namespace {

void check(const HeightMap& map) {
  const size_t pixels = size_t{map.width} * map.height;
  if (pixels == 0 || !(map.pitch_mm_per_px > 0) || map.depth_mm.size() != pixels ||
      map.contact.size() != pixels || (!map.sd_mm.empty() && map.sd_mm.size() != pixels))
    throw Error(Failure::Input, "a height map with its contact, of one size and a pitch > 0 mm",
                std::to_string(map.width) + " x " + std::to_string(map.height) + " px with " +
                    std::to_string(map.depth_mm.size()) + " depths and " +
                    std::to_string(map.contact.size()) + " flags of contact",
                "handing over maps of one frame");
}

/// Half as fine; contact where all four pixels are.
KeyFrame::Unpacked halved(const KeyFrame::Unpacked& fine) {
  KeyFrame::Unpacked out{.width = fine.width / 2,
                         .height = fine.height / 2,
                         .pitch_mm = 2 * fine.pitch_mm,
                         .depth = {},
                         .sd = {},
                         .contact = {}};
  const auto mean = [&](const std::vector<float>& from, size_t at) {
    return (from[at] + from[at + 1] + from[at + fine.width] + from[at + fine.width + 1]) / 4;
  };
  for (uint32_t y = 0; y < out.height; ++y)
    for (uint32_t x = 0; x < out.width; ++x) {
      const size_t at = size_t{2} * y * fine.width + size_t{2} * x;
      out.depth.push_back(mean(fine.depth, at));
      if (!fine.sd.empty()) out.sd.push_back(mean(fine.sd, at));
      const std::vector<uint8_t>& c = fine.contact;
      out.contact.push_back(c[at] != 0 && c[at + 1] != 0 && c[at + fine.width] != 0 &&
                            c[at + fine.width + 1] != 0);
    }
  return out;
}

}  // namespace

KeyFrame::KeyFrame(const HeightMap& map, uint32_t most_px) {
  check(map);
  Unpacked all{.width = map.width,
               .height = map.height,
               .pitch_mm = map.pitch_mm_per_px,
               .depth = {map.depth_mm.begin(), map.depth_mm.end()},
               .sd = {map.sd_mm.begin(), map.sd_mm.end()},
               .contact = {map.contact.begin(), map.contact.end()}};
  // An odd row or column is left out: places stay where they are only for even sizes.
  while (size_t{all.width} * all.height > most_px && all.width % 2 == 0 && all.height % 2 == 0)
    all = halved(all);
  width_ = all.width;
  height_ = all.height;
  pitch_mm_ = all.pitch_mm;
  const size_t pixels = all.depth.size();
  contact_.resize((pixels + 7) / 8);
  size_t inside = 0;
  const uint32_t step = std::max(width_ / 32, 1u);
  for (size_t i = 0; i < pixels; ++i) {
    if (all.contact[i] == 0) continue;
    const size_t column = i % width_, row = i / width_;
    contact_[i / 8] = static_cast<uint8_t>(contact_[i / 8] | 1u << (i % 8));
    const Eigen::Vector3d place(left_mm() + double(column) * pitch_mm_, top_mm() + double(row) * pitch_mm_,
                                double{all.depth[i]});
    middle_mm_ += place;
    ++inside;
    if (column % step == step / 2 && row % step == step / 2) samples_.push_back(place.cast<float>());
  }
  if (inside > 0) middle_mm_ /= double(inside);
  mean_mm_ = middle_mm_[2];
  radius_mm_ = std::sqrt(double(inside) / std::numbers::pi) * pitch_mm_;
  depth_.resize(pixels);
  std::transform(all.depth.begin(), all.depth.end(), depth_.begin(), [&](float depth) {
    return static_cast<int16_t>(
        std::lround(std::clamp((double{depth} - mean_mm_) / kStep_mm, -32767.0, 32767.0)));
  });
  if (all.sd.empty()) return;
  const float largest = *std::max_element(all.sd.begin(), all.sd.end());
  sd_.resize(pixels);
  std::transform(all.sd.begin(), all.sd.end(), sd_.begin(), [&](float sd) {
    return static_cast<uint8_t>(std::clamp(std::lround(255 * sd / largest), 1L, 255L));
  });
}

size_t KeyFrame::bytes() const {
  return depth_.size() * sizeof depth_[0] + sd_.size() + contact_.size() +
         samples_.size() * sizeof samples_[0];
}

KeyFrame::Unpacked KeyFrame::unpacked() const {
  Unpacked out{
      .width = width_, .height = height_, .pitch_mm = pitch_mm_, .depth = {}, .sd = {}, .contact = {}};
  out.depth.resize(depth_.size());
  out.contact.resize(depth_.size());
  for (size_t i = 0; i < depth_.size(); ++i) {
    out.depth[i] = static_cast<float>(mean_mm_ + kStep_mm * depth_[i]);
    out.contact[i] = contact_[i / 8] >> (i % 8) & 1u;
  }
  out.sd.resize(sd_.size());
  std::transform(sd_.begin(), sd_.end(), out.sd.begin(),
                 [](uint8_t sd) { return static_cast<float>(sd) / 255; });
  return out;
}

bool KeyFrame::touches(double x_mm, double y_mm) const {
  const double x = std::round((x_mm - left_mm()) / pitch_mm_), y = std::round((y_mm - top_mm()) / pitch_mm_);
  if (!(x >= 0 && y >= 0 && x < width_ && y < height_)) return false;
  const size_t at = static_cast<size_t>(y) * width_ + static_cast<size_t>(x);
  return (contact_[at / 8] >> (at % 8) & 1u) != 0;
}

double KeyFrame::overlap(const KeyFrame& other, const RigidMotion& motion) const {
  if (samples_.empty() || other.samples_.empty()) return 0;
  double shared = 0;
  for (const Eigen::Vector3f& place : samples_) {
    const Eigen::Vector3d there = motion * place.cast<double>();
    if (other.touches(there[0], there[1])) ++shared;
  }
  const double mine = radius_mm_ * radius_mm_, its = other.radius_mm_ * other.radius_mm_;
  return std::min(shared / double(samples_.size()) * mine / std::max(std::min(mine, its), 1e-12), 1.0);
}

double KeyFrame::shown_by(const HeightMap& other, const RigidMotion& motion) const {
  if (samples_.empty()) return 0;
  const double pitch = other.pitch_mm_per_px;
  size_t shown = 0;
  for (const Eigen::Vector3f& place : samples_) {
    const Eigen::Vector3d there = motion * place.cast<double>();
    const double x = std::round(there[0] / pitch + 0.5 * (other.width - 1)),
                 y = std::round(there[1] / pitch + 0.5 * (other.height - 1));
    if (!(x >= 0 && y >= 0 && x < other.width && y < other.height)) continue;
    if (other.contact[static_cast<size_t>(y) * other.width + static_cast<size_t>(x)] != 0) ++shown;
  }
  return double(shown) / double(samples_.size());
}

}  // namespace palpate

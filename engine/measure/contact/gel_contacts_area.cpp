// Areas of a gel: at rest, and by the depth of the pad in contact and dented.
#include <algorithm>
#include <array>
#include <cmath>

#include "engine/measure/contact/gel_contacts.h"

namespace palpate {
namespace {

constexpr size_t kLevels = 24;       // from rest to the deepest point
constexpr size_t kLeastLevel = 4;    // below, noise and what is drawn down around the object
constexpr double kAsSteep = 0.8;     // of the steepest
constexpr double kFewCells = 12;     // of a dent, whose sides are too short
constexpr double kSureErrors = 5;    // of the heights at rest, by which a dent stands out
constexpr double kDentedErrors = 3;  // likewise, by which a place does

PixelRect around(const PixelRect& a, const PixelRect& b) {
  const uint32_t x = std::min(a.x, b.x), y = std::min(a.y, b.y);
  return {x, y, std::max(a.x + a.width, b.x + b.width) - x, std::max(a.y + a.height, b.y + b.height) - y};
}

}  // namespace

void GelContacts::find_rest() {
  // Among printed markers structure is seen too badly for an outline to be sure.
  for (size_t i = 0; i < foot_.size(); ++i)
    at_rest_[i] =
        (foot_[i] != 0 && owner_[i] != 0) || (patterned_ && raised_[i] >= static_cast<float>(kCore));
  spread(at_rest_, near_, at_rest_, margin_);
  for (uint8_t& rest : at_rest_) rest = rest == 0 && light_known_;
}

void GelContacts::rest_where_unchanged() {
  for (size_t i = 0; i < at_rest_.size(); ++i)
    if (double{raised_[i]} >= kFoot || owner_[i] != 0) at_rest_[i] = 0;
  // An even face that the frame cuts off: a foot and one side of the frame enclose it.
  std::fill(label_.begin(), label_.end(), 0u);
  for (uint32_t from = 0; from < owner_.size(); ++from) {
    if (owner_[from] != 0 || label_[from] != 0) continue;
    flood(from, 1, [this](uint32_t cell) { return owner_[cell] == 0; });
    std::array<bool, 4> sides{};
    for (const uint32_t cell : edge_) {
      const uint32_t x = cell % cells_x_, y = cell / cells_x_;
      sides[0] = sides[0] || x == 0;
      sides[1] = sides[1] || x + 1 == cells_x_;
      sides[2] = sides[2] || y == 0;
      sides[3] = sides[3] || y + 1 == cells_y_;
    }
    if (std::ranges::count(sides, true) == 1)
      for (const uint32_t cell : edge_) at_rest_[cell] = 0;
  }
}

void GelContacts::shrink_to_depth(std::span<const float> depth_mm, std::span<const ContactTouch> gray,
                                  std::vector<ContactTouch>& found) {
  if (count_ == 0) return;
  const double noise_mm = rest_noise_mm(depth_mm);
  edges_.clear();
  for (uint32_t contact = 1; contact <= count_; ++contact)
    edges_.push_back(contact_level(contact, depth_mm, noise_mm));
  for (size_t i = 0; i < foot_.size(); ++i) {
    if (owner_[i] == 0) continue;
    if (const float level = edges_[owner_[i] - 1]; level > 0) foot_[i] = depth_mm[i] >= level;
  }
  outlines_ = found;
  set_shapes(found);
  // An outline encloses the area in contact, unless the touch is too smooth to have one.
  for (size_t k = 0; k < found.size(); ++k) {
    if (outlines_[k].area_px > 0) found[k].box = around(found[k].box, outlines_[k].box);
    found[k].at_border = found[k].at_border || outlines_[k].at_border;
  }
  add_gray(gray, found);
}

// The depth at which the sides of a contact's dent are steepest, by the mean steepness of what lies between
// two levels; 0 where too little is dented to say.
float GelContacts::contact_level(uint32_t contact, std::span<const float> depth_mm, double noise_mm) const {
  float deepest = 0;
  for (size_t i = 0; i < owner_.size(); ++i)
    if (owner_[i] == contact) deepest = std::max(deepest, depth_mm[i]);
  if (!(double{deepest} > kSureErrors * noise_mm)) return 0;
  std::array<double, kLevels> steepness{}, cells{};
  for (uint32_t y = 0; y + 1 < cells_y_; ++y)
    for (uint32_t x = 0; x + 1 < cells_x_; ++x) {
      const size_t cell = size_t{y} * cells_x_ + x, below = cell + cells_x_;
      if (owner_[cell] != contact || owner_[cell + 1] != contact || owner_[below] != contact ||
          owner_[below + 1] != contact)
        continue;
      // Between four cells.
      const float a = depth_mm[cell], b = depth_mm[cell + 1], c = depth_mm[below], d = depth_mm[below + 1];
      const float mean = (a + b + c + d) / 4;
      if (!(mean > 0)) continue;
      const auto level = std::min(static_cast<size_t>(mean / deepest * kLevels), kLevels - 1);
      steepness[level] += std::hypot(double{b + d - a - c}, double{c + d - a - b}) / 2;
      cells[level] += 1;
    }
  double dented = 0;
  for (size_t i = kLeastLevel; i < kLevels; ++i) dented += cells[i];
  if (dented < kFewCells) return 0;
  std::array<double, kLevels> mean{};
  for (size_t i = kLeastLevel; i + 1 < kLevels; ++i)
    if (const double n = cells[i - 1] + cells[i] + cells[i + 1]; n > 0)
      mean[i] = (steepness[i - 1] + steepness[i] + steepness[i + 1]) / n;
  // Inside they get steeper evenly, beyond the edge they level out at once: the outermost of what is as
  // steep.
  const double steepest = *std::ranges::max_element(mean);
  const auto best = std::ranges::find_if(mean, [&](double one) { return one >= kAsSteep * steepest; });
  return deepest * (static_cast<float>(best - mean.begin()) + 0.5f) / static_cast<float>(kLevels);
}

// Root of the mean square of the heights where the pad is at rest, whose mean is 0.
double GelContacts::rest_noise_mm(std::span<const float> depth_mm) const {
  double squares = 0, rest = 0;
  for (size_t i = 0; i < depth_mm.size(); ++i) {
    if (at_rest_[i] == 0) continue;
    squares += double{depth_mm[i]} * double{depth_mm[i]};
    rest += 1;
  }
  return rest > 0 ? std::sqrt(squares / rest) : 0;
}

GelContacts::Dent GelContacts::dent(std::span<const float> depth_mm) const {
  Dent dent{.noise_mm = rest_noise_mm(depth_mm), .level_mm = {}};
  if (count_ == 0) return dent;
  float deepest = 0;
  for (size_t i = 0; i < depth_mm.size(); ++i)
    if (owner_[i] != 0) deepest = std::max(deepest, depth_mm[i]);
  const double level_mm = std::max(kDented * double{deepest}, kDentedErrors * dent.noise_mm);
  dent.level_mm = level_mm;
  for (size_t i = 0; i < depth_mm.size(); ++i)
    if (double{depth_mm[i]} >= level_mm) dent.area_px += double{pixels_[i]};
  return dent;
}

// A flat face with a sharp rim changes the picture along that rim alone, a line too thin to begin a contact.
void GelContacts::fill_rings() {
  const auto ratio = [this](size_t i) { return std::min(change_[i] / noise_[i], static_cast<float>(kCap)); };
  for (size_t i = 0; i < foot_.size(); ++i) foot_[i] = ratio(i) >= static_cast<float>(kCap);
  fill_holes();
  double enclosed_px = 0;
  for (size_t i = 0; i < foot_.size(); ++i)
    if (foot_[i] != 0 && ratio(i) < static_cast<float>(kCap)) enclosed_px += double{pixels_[i]};
  if (enclosed_px < kLeastRing * least_px_) return;
  for (size_t i = 0; i < raised_.size(); ++i)
    raised_[i] = foot_[i] != 0 ? static_cast<float>(kCap) : ratio(i);
  for (const uint32_t radius : radii_) blur(raised_, radius);
}

}  // namespace palpate

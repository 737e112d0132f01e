#include "engine/measure/contact/gel_contacts.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "engine/base/statistics.h"
#include "engine/measure/height_rows.h"

namespace palpate {
namespace {

using shared::kCellSide;
constexpr float kNoise_gray2 = 0.75f;      // of a camera, until it is learned
constexpr float kLeastNoise_gray2 = 0.3f;  // rounding and compression leave this much
constexpr size_t kLightCells = 1500;       // that the light is estimated from
constexpr double kOtherLight = 0.05;       // of a colour's mean, as PadMatch has it
constexpr uint64_t kPriorFrames = 4, kMemory_frames = 64;
constexpr float kOverMedian = 0.9f;      // of the first frames' change: noise
constexpr float kLeastStructure = 0.7f;  // over noise, which alone makes half of it
constexpr float kLeastClean = 0.5f;      // of the weight of steady cells about a place
constexpr float kFewSteady = 0.25f;      // of it over the whole picture: below, a pattern is printed on it
constexpr uint8_t kSeen = GelContacts::kMostContacts + 1;  // of cells: an onset, but no contact yet
constexpr double kUnsteady = 0.1;           // of the untouched picture's variance over 3 x 3 cells
constexpr double kEvenReach = 0.25;         // of the reach, within which light is even
constexpr double kFine = 0.4;               // of the reach, for outlines
constexpr double kWideReach_px = 1.0 / 24;  // of the frame's width, where a sensor has no scale

double squares_of(const shared::CellChange& cell, uint32_t colour) {
  return colour == 0 ? cell.red_squares : colour == 1 ? cell.green_squares : cell.blue_squares;
}
double sum_of(const shared::CellChange& cell, uint32_t colour) {
  return colour == 0 ? cell.red : colour == 1 ? cell.green : cell.blue;
}

}  // namespace

GelContacts::GelContacts(const Sensor& sensor, const FrameFormat& format)
    : format_(format),
      scale_{std::floor(format.width / 2.0), std::floor(format.height / 2.0), sensor.pitch_mm_per_px},
      cells_x_(cells_along(format.width)),
      cells_y_(cells_along(format.height)),
      estimate_(size_t{cells_x_} * cells_y_) {
  const bool scaled = has_scale(sensor);
  const double reach_px = scaled ? kReach_mm / sensor.pitch_mm_per_px : kWideReach_px * format.width;
  // Three running means of width 2 r + 1 have the variance r (r + 1).
  const double variance = std::pow(reach_px / kCellSide, 2);
  const double radius = (std::sqrt(1 + 4 * variance) - 1) / 2;
  const auto low = static_cast<uint32_t>(radius);
  radii_.fill(std::max(low, 1u));
  for (size_t i = 0; i < 3; ++i)
    if (radius - low > (static_cast<double>(i) + 0.5) / 3) radii_[i] = low + 1;
  even_radius_ = std::max(1u, static_cast<uint32_t>(std::lround(radius * kEvenReach)));
  fine_radius_ = std::max(1u, static_cast<uint32_t>(std::lround(radius * kFine)));
  least_px_ = scaled ? kLeast_mm2 / std::pow(sensor.pitch_mm_per_px, 2) : smallest_contact_px(sensor, format);
  const size_t cells = size_t{cells_x_} * cells_y_;
  sample_step_ = std::max<size_t>(cells / kLightCells, 1);
  if (sample_step_ > 1 && cells_x_ % sample_step_ == 0) ++sample_step_;  // not the same columns in every row
  for (auto* values : {&sample_, &sample_rest_}) values->assign((cells - 1) / sample_step_ + 1, 0);
  for (auto& gray : rest_gray_) gray.assign(cells, 0);
  for (auto& mean : means_) mean.assign(cells, 0);
  for (auto* values : {&unsteady_, &change_, &strength_, &even_, &raised_, &scratch_, &sorted_})
    values->assign(cells, 0);
  noise_.assign(cells, kNoise_gray2);
  foot_.assign(cells, 0);
  at_rest_.assign(cells, 1);
  near_.assign(cells, 0);
  if (scaled) {
    apart_ = static_cast<uint32_t>(std::lround(kApart_mm / sensor.pitch_mm_per_px / kCellSide));
    far_px_ = kLeastApart_mm2 / std::pow(sensor.pitch_mm_per_px, 2);
  }
  margin_ =
      std::max(1u, static_cast<uint32_t>(std::lround(reach_px / kCellSide * kRestMargin_mm / kReach_mm)));
  basins_ = DepthBasins({.cells_x = cells_x_, .cells_y = cells_y_, .margin = margin_, .least_px = least_px_});
  before_.assign(cells, 0);
  for (Pieces* pieces : {&by_depth_, &by_structure_}) {
    pieces->of_cell.assign(cells, 0);
    pieces->before.assign(cells, 0);
    pieces->owner.reserve(2 * kMostContacts + 1);
  }
  for (auto* numbers : {&seen_piece_, &confirmed_, &number_of_, &lineage_of_, &foot_of_})
    numbers->reserve(2 * kMostContacts + 1);
  parts_.reserve(cells);
  label_.assign(cells, 0);
  owner_.assign(cells, 0);
  edges_.reserve(kMostContacts);
  feet_.reserve(cells);
  heir_.reserve(kMostContacts + 1);
  shared_px_.reserve(kSeen + 1);
  moments_.resize(2 * kMostContacts + 1);
  outlines_.reserve(2 * kMostContacts + 1), outline_of_.reserve(2 * kMostContacts + 1);
  for (auto* numbers : {&lineage_, &lineage_before_}) numbers->assign(kMostContacts + 1, 0);
  edge_.reserve(cells);
  for (uint32_t y = 0; y < cells_y_; ++y)
    for (uint32_t x = 0; x < cells_x_; ++x)
      pixels_.push_back(static_cast<float>(std::min(kCellSide, format.width - x * kCellSide) *
                                           std::min(kCellSide, format.height - y * kCellSide)));
}

void GelContacts::set_background(const Frame& background) {
  for (uint32_t colour = 0; colour < 3; ++colour)
    for (uint32_t y = 0; y < cells_y_; ++y)
      for (uint32_t x = 0; x < cells_x_; ++x) {
        uint32_t sum = 0;
        for (uint32_t v = y * kCellSide; v < std::min((y + 1) * kCellSide, format_.height); ++v)
          for (uint32_t u = x * kCellSide; u < std::min((x + 1) * kCellSide, format_.width); ++u)
            sum += background.at(colour, u, v);
        const size_t cell = size_t{y} * cells_x_ + x;
        rest_gray_[colour][cell] = static_cast<float>(sum) / pixels_[cell];
      }
  find_unsteady(background);
  restart();
}

void GelContacts::restart() {
  noise_.assign(noise_.size(), kNoise_gray2);
  before_.assign(before_.size(), 0);
  for (Pieces* pieces : {&by_depth_, &by_structure_})
    std::fill(pieces->of_cell.begin(), pieces->of_cell.end(), 0u);
  trust_.restart();
  frames_ = 0;
}

// Things that move with the skin, such as specks and scratches, or flicker, such as lamps' edges, change by
// a share of how the untouched picture varies around it.
void GelContacts::find_unsteady(const Frame& background) {
  std::fill(unsteady_.begin(), unsteady_.end(), 0.0f);
  const auto around = [](uint32_t cell, uint32_t size) {
    return std::pair{cell * kCellSide - std::min(cell * kCellSide, kCellSide),
                     std::min((cell + 2) * kCellSide, size)};
  };
  for (uint32_t colour = 0; colour < 3; ++colour)
    for (uint32_t y = 0; y < cells_y_; ++y)
      for (uint32_t x = 0; x < cells_x_; ++x) {
        const auto [v0, v1] = around(y, format_.height);
        const auto [u0, u1] = around(x, format_.width);
        double n = 0, sum = 0, squares = 0;
        for (uint32_t v = v0; v < v1; ++v)
          for (uint32_t u = u0; u < u1; ++u) {
            const double gray = background.at(colour, u, v);
            n += 1, sum += gray, squares += gray * gray;
          }
        const double variance = std::max(squares / n - std::pow(sum / n, 2), 0.0);
        unsteady_[size_t{y} * cells_x_ + x] += static_cast<float>(kUnsteady * variance / 3);
      }
  float steady = 0;
  for (const float unsteady : unsteady_) steady += kNoise_gray2 / (kNoise_gray2 + unsteady);
  patterned_ = steady < kFewSteady * static_cast<float>(unsteady_.size());
  if (patterned_) std::fill(unsteady_.begin(), unsteady_.end(), 0.0f);
}

void GelContacts::find(std::span<const shared::CellChange> cells, std::span<const ContactTouch> gray,
                       std::vector<ContactTouch>& found) {
  estimate_light(cells);
  compare(cells);
  smooth();
  mark_foot();
  fill_holes();
  collect(found);
  find_rest();
  learn();
  add_gray(gray, found);
}

void GelContacts::estimate_light(std::span<const shared::CellChange> cells) {
  light_known_ = true;
  double share = 1;
  for (uint32_t colour = 0; colour < 3; ++colour) {
    for (size_t i = 0; i < pixels_.size(); ++i)
      means_[colour][i] = static_cast<float>(sum_of(cells[i], colour)) / pixels_[i];
    for (size_t i = 0, cell = 0; i < sample_.size(); ++i, cell += sample_step_) {
      sample_[i] = means_[colour][cell];
      sample_rest_[i] = rest_gray_[colour][cell];
    }
    light_[colour] = estimate_.find(sample_, sample_rest_);
    light_known_ = light_known_ && light_[colour].known;
    share = std::min(share, light_[colour].share);
  }
  light_trusted_ = trust_.enough(share);
}

bool GelContacts::other_light() const {
  for (uint32_t colour = 0; colour < 3; ++colour) {
    const std::vector<float>& rest = rest_gray_[colour];
    const double mean = std::accumulate(rest.begin(), rest.end(), 0.0) /
                        static_cast<double>(std::max<size_t>(rest.size(), 1));
    const LightChange& light = light_[colour];
    if (std::abs(light.at(mean)) > kOtherLight * mean + 2 * std::sqrt(light.variance())) return true;
  }
  return false;
}

void GelContacts::compare(std::span<const shared::CellChange> cells) {
  for (size_t i = 0; i < pixels_.size(); ++i) {
    double sum = 0;
    for (uint32_t colour = 0; colour < 3; ++colour) {
      const double light = light_[colour].at(double{rest_gray_[colour][i]});
      sum +=
          squares_of(cells[i], colour) / double{pixels_[i]} + light * (light - 2 * double{means_[colour][i]});
    }
    change_[i] = static_cast<float>(std::max(sum / 3, 0.0));
  }
  if (frames_ < kPriorFrames) {
    // Most of the first frames is untouched, as the background is taken to be.
    sorted_ = change_;
    const float usual = kOverMedian * median_in_place(sorted_);
    for (float& noise : noise_) noise = std::max(noise, usual);
  }
  for (size_t i = 0; i < pixels_.size(); ++i)
    raised_[i] = std::min(change_[i] / noise_[i], static_cast<float>(kCap));
}

void GelContacts::smooth() {
  for (const uint32_t radius : radii_) blur(raised_, radius);
  if (std::ranges::max(raised_) < static_cast<float>(kOnset)) fill_rings();
  // How each colour's change varies from pixel to pixel and cell to cell: light that glows through the gel
  // changes evenly.
  for (size_t i = 0; i < strength_.size(); ++i) {
    float even = 0;
    for (uint32_t colour = 0; colour < 3; ++colour) {
      const double from_light = double{means_[colour][i]} - light_[colour].at(double{rest_gray_[colour][i]});
      even += static_cast<float>(from_light * from_light) / 3;
    }
    strength_[i] = std::max(change_[i] - even - noise_[i], 0.0f);
  }
  for (uint32_t colour = 0; colour < 3; ++colour) {
    even_ = means_[colour];
    blur(even_, even_radius_);
    for (size_t i = 0; i < even_.size(); ++i) {
      const float varies = means_[colour][i] - even_[i];
      strength_[i] += varies * varies / 3;
    }
  }
  for (size_t i = 0; i < strength_.size(); ++i) {
    const float clean = 1 / (noise_[i] + unsteady_[i]);
    strength_[i] *= clean;
    even_[i] = noise_[i] * clean;
  }
  for (int pass = 0; pass < 3; ++pass) {
    blur(strength_, fine_radius_);
    blur(even_, fine_radius_);
  }
  for (size_t i = 0; i < strength_.size(); ++i) strength_[i] /= std::max(even_[i], kLeastClean);
}

void GelContacts::blur(std::vector<float>& values, uint32_t radius) {
  blur_rows(values, radius);
  blur_columns(values, radius);
}

// Running means; at the border of what lies within.
void GelContacts::blur_rows(const std::vector<float>& values, uint32_t radius) {
  for (uint32_t y = 0; y < cells_y_; ++y) {
    const float* from = values.data() + size_t{y} * cells_x_;
    float* to = scratch_.data() + size_t{y} * cells_x_;
    double sum = 0;
    for (uint32_t x = 0; x < std::min(radius, cells_x_); ++x) sum += double{from[x]};
    const double whole = 1.0 / (2 * radius + 1);  // divisions are most of the time
    for (uint32_t x = 0; x < cells_x_; ++x) {
      if (x + radius < cells_x_) sum += double{from[x + radius]};
      if (x > radius) sum -= double{from[x - radius - 1]};
      const uint32_t first = x - std::min(x, radius), last = std::min(x + radius, cells_x_ - 1);
      const uint32_t cells = last - first + 1;
      to[x] = static_cast<float>(cells == 2 * radius + 1 ? sum * whole : sum / cells);
    }
  }
}

void GelContacts::blur_columns(std::vector<float>& values, uint32_t radius) {
  std::vector<float>& sums = sorted_;
  std::fill_n(sums.begin(), cells_x_, 0.0f);
  const auto add = [&](uint32_t y, float sign) {
    const float* row = scratch_.data() + size_t{y} * cells_x_;
    for (uint32_t x = 0; x < cells_x_; ++x) sums[x] += sign * row[x];
  };
  for (uint32_t y = 0; y < std::min(radius, cells_y_); ++y) add(y, 1);
  for (uint32_t y = 0; y < cells_y_; ++y) {
    if (y + radius < cells_y_) add(y + radius, 1);
    if (y > radius) add(y - radius - 1, -1);
    const uint32_t first = y - std::min(y, radius), last = std::min(y + radius, cells_y_ - 1);
    const float share = 1 / static_cast<float>(last - first + 1);
    float* to = values.data() + size_t{y} * cells_x_;
    for (uint32_t x = 0; x < cells_x_; ++x) to[x] = sums[x] * share;
  }
}

void GelContacts::learn() {
  ++frames_;
  const auto share =
      static_cast<float>(1.0 / static_cast<double>(std::min(frames_ + kPriorFrames, kMemory_frames)));
  for (size_t i = 0; i < noise_.size(); ++i) {
    if (raised_[i] >= kFoot) continue;
    const float seen = std::clamp(change_[i], kLeastNoise_gray2, 4 * noise_[i]);
    noise_[i] += share * (seen - noise_[i]);
  }
}

void GelContacts::mark_foot() {
  for (size_t i = 0; i < foot_.size(); ++i) foot_[i] = raised_[i] >= static_cast<float>(kFoot);
}

// A hole in a foot that does not reach the frame's border belongs to the foot around it.
void GelContacts::fill_holes() {
  constexpr uint32_t kOutside = 1;
  std::fill(label_.begin(), label_.end(), 0u);
  const auto start = [&](uint32_t x, uint32_t y) {
    const uint32_t cell = y * cells_x_ + x;
    if (foot_[cell] == 0 && label_[cell] == 0)
      flood(cell, kOutside, [this](uint32_t one) { return foot_[one] == 0; });
  };
  for (uint32_t x = 0; x < cells_x_; ++x) start(x, 0), start(x, cells_y_ - 1);
  for (uint32_t y = 0; y < cells_y_; ++y) start(0, y), start(cells_x_ - 1, y);
  for (size_t i = 0; i < foot_.size(); ++i) foot_[i] = foot_[i] || label_[i] != kOutside;
}

// The connected feet that hold a core, numbered from 1 in owner_; returns how many.
uint32_t GelContacts::number_contacts() {
  std::fill(label_.begin(), label_.end(), 0u);
  std::fill(owner_.begin(), owner_.end(), 0u);
  feet_.clear();
  heir_.assign(kMostContacts + 1, 0);
  for (uint32_t cell = 0; cell < label_.size(); ++cell) {
    if (foot_[cell] == 0 || label_[cell] != 0) continue;
    flood(cell, static_cast<uint32_t>(feet_.size()) + 1, [this](uint32_t one) { return foot_[one] != 0; });
    feet_.push_back(foot_of_edge());
  }
  // Where a contact splits, only the part with most of its pixels keeps its identity; the others start anew.
  for (uint32_t i = 0; i < feet_.size(); ++i) {
    const Foot& foot = feet_[i];
    uint32_t& heir = heir_[foot.before];
    if (foot.before != 0 && (heir == 0 || foot.shared_px > feet_[heir - 1].shared_px)) heir = i + 1;
  }
  std::swap(lineage_, lineage_before_);
  lineage_.assign(1, 0);
  foot_of_.assign(1, 0);
  float clearest = 0;
  for (uint32_t i = 0; i < feet_.size(); ++i)
    if (counts(feet_[i], i)) clearest = std::max(clearest, feet_[i].strongest);
  uint32_t count = 0;
  for (uint32_t i = 0; i < feet_.size(); ++i) {
    Foot& foot = feet_[i];
    if (count >= kMostContacts || !counts(foot, i)) continue;
    // A press changes the light at the pad's sides too; that has no structure.
    if (foot.at_border && double{foot.strongest} < kFaint &&
        double{clearest} >= kClearer * double{foot.strongest})
      continue;
    const bool goes_on = foot.before != 0 && heir_[foot.before] == i + 1;
    foot.contact = ++count;
    lineage_.push_back(goes_on ? lineage_before_[foot.before] : ++last_lineage_);
    foot_of_.push_back(count);
  }
  for (uint32_t cell = 0; cell < owner_.size(); ++cell) {
    if (label_[cell] == 0) {
      before_[cell] = 0;
      continue;
    }
    const Foot& foot = feet_[label_[cell] - 1];
    owner_[cell] = foot.contact;
    const bool is_seen = double{foot.highest} >= kOnset;
    before_[cell] = foot.contact != 0 ? static_cast<uint8_t>(foot.contact) : is_seen ? kSeen : 0;
  }
  return count;
}

// Whether a foot begins a contact, or goes on with one.
bool GelContacts::counts(const Foot& foot, uint32_t index) const {
  if (foot.area_px < least_px_) return false;
  const bool goes_on = foot.before != 0 && heir_[foot.before] == index + 1;
  const bool begins = double{foot.highest} >= (foot.was_seen || frames_ == 0 ? kOnset : kSureOnset);
  return begins || (goes_on && double{foot.highest} >= kCore);
}

// Foot of the cells that edge_ holds.
GelContacts::Foot GelContacts::foot_of_edge() {
  Foot foot;
  shared_px_.assign(kSeen + 1, 0);
  for (const uint32_t one : edge_) {
    foot.highest = std::max(foot.highest, raised_[one]);
    foot.strongest = std::max(foot.strongest, strength_[one]);
    const uint32_t x = one % cells_x_, y = one / cells_x_;
    foot.at_border = foot.at_border || x == 0 || y == 0 || x + 1 == cells_x_ || y + 1 == cells_y_;
    foot.area_px += double{pixels_[one]};
    shared_px_[before_[one]] += double{pixels_[one]};
  }
  for (uint32_t k = 1; k <= kMostContacts; ++k)
    if (shared_px_[k] > foot.shared_px) foot.before = k, foot.shared_px = shared_px_[k];
  foot.was_seen = foot.before != 0 || shared_px_[kSeen] > 0;
  return foot;
}

float GelContacts::outline_level(uint32_t contact) {
  sorted_.clear();
  for (size_t i = 0; i < owner_.size(); ++i)
    if (owner_[i] == contact) sorted_.push_back(strength_[i]);
  const float level = level_of_sorted();
  sorted_.resize(pixels_.size());
  return level;
}

// Level of the strengths that sorted_ holds.
float GelContacts::level_of_sorted() {
  const auto high = sorted_.begin() + static_cast<std::ptrdiff_t>(sorted_.size() * 19 / 20);
  std::nth_element(sorted_.begin(), high, sorted_.end());
  return std::max(static_cast<float>(kOutline) * *high, kLeastStructure);
}

void GelContacts::collect(std::vector<ContactTouch>& found) {
  count_ = number_contacts();
  mark_outlines();
  if (split_by_structure()) {
    mark_outlines();
    if (join_what_one_makes()) mark_outlines();
  }
  set_shapes(found);
}

void GelContacts::mark_outlines() {
  edges_.clear();
  for (uint32_t k = 1; k <= count_; ++k) edges_.push_back(outline_level(k));
  for (size_t i = 0; i < foot_.size(); ++i)
    foot_[i] = owner_[i] != 0 && strength_[i] >= edges_[owner_[i] - 1];
  fill_holes();
}

void GelContacts::set_shapes(std::vector<ContactTouch>& found) {
  found.clear();
  found.resize(count_);
  std::fill(moments_.begin(), moments_.end(), ContactMoments{});
  for (ContactTouch& contact : found) contact.box = {UINT32_MAX, UINT32_MAX, 0, 0};
  for (uint32_t cell = 0; cell < foot_.size(); ++cell)
    if (foot_[cell] != 0 && owner_[cell] != 0)
      add_cell(cell, moments_[owner_[cell]], found[owner_[cell] - 1].box);
  ContactMoments all;
  for (size_t k = 0; k < found.size(); ++k) {
    const ContactMoments& m = moments_[k + 1];
    PixelRect& box = found[k].box;  // until here its last row and column
    box = m.area == 0 ? PixelRect{} : PixelRect{box.x, box.y, box.width - box.x, box.height - box.y};
    set_shape(found[k], m, scale_);
    found[k].id = lineage_[foot_of_[k + 1]];
    all.area += m.area, all.x += m.x, all.y += m.y;
    all.xx += m.xx, all.xy += m.xy, all.yy += m.yy;
    all.border = all.border || m.border;
  }
  set_shape(whole_, all, scale_);
}

// `box` holds the first and the last row and column, those one further.
void GelContacts::add_cell(uint32_t cell, ContactMoments& m, PixelRect& box) const {
  const uint32_t x0 = cell % cells_x_ * kCellSide, y0 = cell / cells_x_ * kCellSide;
  const uint32_t x1 = std::min(x0 + kCellSide, format_.width), y1 = std::min(y0 + kCellSide, format_.height);
  for (uint32_t v = y0; v < y1; ++v)
    for (uint32_t u = x0; u < x1; ++u) {
      const int64_t x = int64_t{u} - format_.width / 2, y = int64_t{v} - format_.height / 2;
      ++m.area;
      m.x += x, m.y += y;
      m.xx += x * x, m.xy += x * y, m.yy += y * y;
    }
  m.border = m.border || x0 == 0 || y0 == 0 || x1 == format_.width || y1 == format_.height;
  box = {std::min(box.x, x0), std::min(box.y, y0), std::max(box.width, x1), std::max(box.height, y1)};
}

// Marks cells that have a marked one within `reach` along their row, and then along their column.
void GelContacts::spread(const std::vector<uint8_t>& from, std::vector<uint8_t>& rows,
                         std::vector<uint8_t>& to, uint32_t reach) const {
  const auto along = [reach](const std::vector<uint8_t>& in, std::vector<uint8_t>& out, uint32_t lines,
                             uint32_t length, size_t line_step, size_t step) {
    for (uint32_t line = 0; line < lines; ++line) {
      uint32_t count = 0;
      const auto at = [&](uint32_t i) { return line * line_step + i * step; };
      for (uint32_t i = 0; i < std::min(reach, length); ++i) count += in[at(i)] != 0;
      for (uint32_t i = 0; i < length; ++i) {
        if (i + reach < length) count += in[at(i + reach)] != 0;
        if (i > reach) count -= in[at(i - reach - 1)] != 0;
        out[at(i)] = count > 0;
      }
    }
  };
  along(from, rows, cells_y_, cells_x_, cells_x_, 1);
  along(rows, to, cells_x_, cells_y_, 1, cells_x_);
}

void GelContacts::add_gray(std::span<const ContactTouch> gray, std::vector<ContactTouch>& found) {
  for (const ContactTouch& region : gray) {
    const auto x = static_cast<uint32_t>(std::max(region.centroid_x_px, 0.0)) / kCellSide;
    const auto y = static_cast<uint32_t>(std::max(region.centroid_y_px, 0.0)) / kCellSide;
    const uint32_t owner = owner_[size_t{std::min(y, cells_y_ - 1)} * cells_x_ + std::min(x, cells_x_ - 1)];
    if (owner == 0) continue;
    ContactTouch& contact = found[owner - 1];
    contact.gray_sum += region.gray_sum;
    contact.peak_gray = std::max(contact.peak_gray, region.peak_gray);
    contact.saturated_px += region.saturated_px;
  }
}

}  // namespace palpate

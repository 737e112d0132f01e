#include "capture/run/rest_check.h"

#include <algorithm>
#include <cmath>

#include "engine/base/numbers.h"
#include "engine/base/statistics.h"
#include "engine/base/text.h"

namespace palpate {
namespace {

constexpr uint32_t kRestSide = 8;      // px
constexpr int kAround = 4;             // cells to each side that a cell is compared with
constexpr double kOverScatter = 6;     // a cell's difference over its usual scatter
constexpr double kLeastChange = 0.02;  // of full scale
constexpr size_t kLeastCells = 12;     // connected
constexpr double kMoreStructure = 5;   // of the image that is touched, in a region off the frame's border
constexpr double kLeastOfRest = 0.6,
                 kMostOfRest = 1.8;     // of that structure in the difference: else the lamps'
constexpr double kAgainstSignal = 0.8;  // fraction of a difference against the signal
constexpr double kBulge = 0.8;          // beside a press a gel bulges and changes the other way, by less
constexpr double kOtherLight = 0.05;    // of the untouched image's mean, as PadMatch has it
constexpr double kLeastLight = 0.004;   // of full scale
constexpr double kFewFrames = 0.05;     // of those looked at
constexpr int kTouchCells = 4;          // that change one way, and as many times more than the other way

}  // namespace

RestCheck::RestCheck(const Frame& background, const Sensor& sensor)
    : format_(background.format),
      signal_(sensor.signal),
      cells_x_(background.format.width / kRestSide),
      cells_y_(background.format.height / kRestSide),
      rest_(cells_of(background)),
      difference_(size_t{cells_x_} * cells_y_),
      differs_(difference_.size()),
      seen_(difference_.size()) {}

RestCheck::Cells RestCheck::cells_of(const Frame& frame) const {
  Cells cells;
  const size_t count = size_t{cells_x_} * cells_y_;
  for (uint32_t c = 0; c < format_.channels; ++c) {
    std::vector<float> means(count), structure(count);
    for (uint32_t y = 0; y < cells_y_; ++y)
      for (uint32_t x = 0; x < cells_x_; ++x) {
        uint64_t sum = 0;
        for (uint32_t v = 0; v < kRestSide; ++v)
          for (uint32_t u = 0; u < kRestSide; ++u) sum += frame.at(c, x * kRestSide + u, y * kRestSide + v);
        means[size_t{y} * cells_x_ + x] = static_cast<float>(sum) / (kRestSide * kRestSide);
      }
    for (int y = 0; y < static_cast<int>(cells_y_); ++y)
      for (int x = 0; x < static_cast<int>(cells_x_); ++x) {
        double sum = 0, n = 0;
        for (int v = std::max(y - kAround, 0); v <= std::min(y + kAround, static_cast<int>(cells_y_) - 1);
             ++v)
          for (int u = std::max(x - kAround, 0); u <= std::min(x + kAround, static_cast<int>(cells_x_) - 1);
               ++u)
            sum += double{means[static_cast<size_t>(v) * cells_x_ + static_cast<size_t>(u)]}, n += 1;
        const size_t i = static_cast<size_t>(y) * cells_x_ + static_cast<size_t>(x);
        structure[i] = means[i] - static_cast<float>(sum / n);
      }
    cells.means.push_back(std::move(means));
    cells.structure.push_back(std::move(structure));
  }
  return cells;
}

void RestCheck::compare(const Cells& now) {
  std::fill(differs_.begin(), differs_.end(), uint8_t{0});
  std::fill(difference_.begin(), difference_.end(), 0.0f);
  for (uint32_t c = 0; c < format_.channels; ++c) {
    std::vector<float> change(difference_.size());
    for (size_t i = 0; i < change.size(); ++i) change[i] = now.means[c][i] - rest_.means[c][i];
    const float light = median(change);
    for (float& value : change) value -= light;
    sorted_ = change;
    for (float& value : sorted_) value = std::abs(value);
    const double scatter = double{median_in_place(sorted_)} / 0.6745;
    const double limit = std::max(kOverScatter * scatter, kLeastChange * format_.max_gray());
    for (size_t i = 0; i < change.size(); ++i) {
      difference_[i] += change[i];
      if (std::abs(double{change[i]}) > limit) differs_[i] = 1;
    }
  }
}

bool RestCheck::judge(uint32_t from, const Cells& now) {
  region_.assign(1, from);
  differs_[from] = 0;
  bool border = false;  // lamps shine there, and what is pressed may hide them
  for (size_t next = 0; next < region_.size(); ++next) {
    const uint32_t cell = region_[next], x = cell % cells_x_, y = cell / cells_x_;
    border = border || x == 0 || y == 0 || x + 1 == cells_x_ || y + 1 == cells_y_;
    const auto visit = [&](uint32_t to) {
      if (differs_[to] == 0) return;
      differs_[to] = 0;
      region_.push_back(to);
    };
    if (x > 0) visit(cell - 1);
    if (x + 1 < cells_x_) visit(cell + 1);
    if (y > 0) visit(cell - cells_x_);
    if (y + 1 < cells_y_) visit(cell + cells_x_);
  }
  if (region_.size() < kLeastCells) return false;
  double up = 0, all = 0, peak = 0, of_rest = 0, of_frame = 0, of_difference = 0;
  for (const uint32_t cell : region_) {
    const double difference = double{difference_[cell]};
    up += std::max(difference, 0.0);
    all += std::abs(difference);
    peak = std::max(peak, std::abs(difference));
    for (uint32_t c = 0; c < format_.channels; ++c) {
      const double rest = double{rest_.structure[c][cell]}, frame = double{now.structure[c][cell]};
      of_rest += rest * rest;
      of_frame += frame * frame;
      of_difference += (frame - rest) * (frame - rest);
    }
  }
  const bool touched = signal_ == Signal::Brighter
                           ? up < (1 - kAgainstSignal) * all && peak > kBulge * pressed_
                       : signal_ == Signal::Darker ? up > kAgainstSignal * all && peak > kBulge * pressed_
                                                   : !border && of_rest > kMoreStructure * of_frame &&
                                                         of_difference > kLeastOfRest * of_rest &&
                                                         of_difference < kMostOfRest * of_rest;
  if (touched)
    for (const uint32_t cell : region_) ++seen_[cell];
  return touched;
}

void RestCheck::weigh() {
  if (signal_ == Signal::Either) return;
  int by = 0, against = 0;
  for (size_t i = 0; i < differs_.size(); ++i)
    if (differs_[i] != 0) ++((difference_[i] > 0) == (signal_ == Signal::Brighter) ? by : against);
  by_signal_ += by >= kTouchCells && kTouchCells * by > against;
  against_ += against >= kTouchCells && against > kTouchCells * by;
}

// No touch covers nine tenths of a picture evenly, and none makes half of it change against the signal.
void RestCheck::weigh_light(const Cells& now) {
  if (signal_ == Signal::Either) return;
  const float sign = signal_ == Signal::Darker ? -1.0f : 1.0f;
  sorted_.clear();
  double rest = 0;
  for (size_t i = 0; i < rest_.means[0].size(); ++i) {
    sorted_.push_back(sign * (now.means[0][i] - rest_.means[0][i]));
    rest += double{rest_.means[0][i]} / static_cast<double>(rest_.means[0].size());
  }
  const double least = std::max(kOtherLight * rest, kLeastLight * format_.max_gray());
  const double low = quantile_in_place(sorted_, 0.1), half = median_in_place(sorted_);
  if (low > least) light_.push_back(static_cast<float>(double{sign} * low / rest));
  if (half < -least) light_.push_back(static_cast<float>(double{sign} * half / rest));
}

void RestCheck::add(const Frame& frame) {
  const uint64_t n = frames_++;
  if ((n >= kAll && n % kEvery != 0) || cells_x_ == 0 || cells_y_ == 0) return;
  ++looked_;
  const Cells now = cells_of(frame);
  compare(now);
  pressed_ = 0;
  for (const float difference : difference_)
    pressed_ = std::max(pressed_, double{signal_ == Signal::Darker ? -difference : difference});
  weigh();
  weigh_light(now);
  bool any = false;
  for (uint32_t cell = 0; cell < differs_.size(); ++cell)
    if (differs_[cell] != 0) any = judge(cell, now) || any;
  missing_ += any;
}

double RestCheck::evidence() const {
  double seen = 0;
  for (const uint32_t count : seen_) seen += count;
  const double all = static_cast<double>(looked_) * static_cast<double>(seen_.size());
  return all > 0 ? seen / all : 0;
}

std::string RestCheck::warning() const {
  const char* other = signal_ == Signal::Brighter ? "darker" : "brighter";
  const bool wrong_way = 10 * by_signal_ < against_ &&
                         static_cast<double>(against_) >= kFewFrames * static_cast<double>(looked_);
  if (wrong_way && against_ < looked_)
    return text(
        "touch makes the picture %s in %llu of %llu frames and hardly ever %s, which the sensor file calls "
        "its "
        "signal: \"contact\": {\"signal\": \"%s\"} there",
        other, static_cast<unsigned long long>(against_), static_cast<unsigned long long>(looked_),
        to_string(signal_), other);
  if (light_.size() > 1 && static_cast<double>(light_.size()) > kFewFrames * static_cast<double>(looked_)) {
    const double change = 100 * double{median(light_)};
    return text(
        "%zu of %llu frames are %.0f %% %s than the untouched image (another exposure or lamp, unless a "
        "touch "
        "covers all of it): force and depth are wrong by that; fixed exposure and gain, or an untouched "
        "image "
        "of today (--background)",
        light_.size(), static_cast<unsigned long long>(looked_), std::abs(change),
        change > 0 ? "brighter" : "darker");
  }
  const uint32_t most = seen_.empty() ? 0 : *std::max_element(seen_.begin(), seen_.end());
  const uint32_t least = looked_ <= 2 ? 1 : 2;
  if (most < least || static_cast<double>(most) < kFewFrames * static_cast<double>(looked_)) return {};
  double x_px = 0, y_px = 0, cells = 0;
  for (uint32_t i = 0; i < seen_.size(); ++i) {
    if (2 * seen_[i] < most) continue;
    x_px += (i % cells_x_ + 0.5) * kRestSide;
    const uint32_t row = i / cells_x_;
    y_px += (row + 0.5) * kRestSide;
    cells += 1;
  }
  const double wide_px = 2 * kRestSide * std::sqrt(cells / kPi);
  return text(
      "the untouched image shows a touch itself, %.0f px wide around (%.0f, %.0f) px, that is missing in "
      "%llu "
      "of %llu frames: what is measured there is wrong; give an image without touch (--background)%s",
      wide_px, x_px / cells, y_px / cells, static_cast<unsigned long long>(missing_),
      static_cast<unsigned long long>(looked_),
      wrong_way
          ? text("; if it shows none, touch makes the picture %s: \"contact\": {\"signal\": \"%s\"} in the "
                 "sensor file",
                 other, other)
                .c_str()
          : "");
}

}  // namespace palpate

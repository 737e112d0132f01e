#include "viz/render/view_state.h"

#include <algorithm>
#include <cmath>
#include <initializer_list>

#include "engine/sensor/fit.h"

namespace palpate::viz {

namespace {
double ceiling_of(std::initializer_list<double> series, double value) {
  const double power = std::pow(10.0, std::floor(std::log10(std::max(value, 1e-9))));
  for (const double step : series) {
    if (value <= step * power * (1 + 1e-9)) return step * power;
  }
  return 10 * power;
}
}  // namespace

double nice_ceiling(double value) {
  return ceiling_of({1, 2, 5}, value);
}

double scale_ceiling(double value) {
  return ceiling_of({1, 1.5, 2, 2.5, 3, 4, 5, 6, 8}, value);
}

std::optional<PlayedPart> with_end(std::optional<PlayedPart> part, PartEnd end, uint64_t at,
                                   uint64_t frames) {
  const uint64_t last = frames > 0 ? frames - 1 : 0;
  switch (end) {
    case PartEnd::Keep:
      return part;
    case PartEnd::First:
      return PlayedPart{at, part && part->last > at ? part->last : last};
    case PartEnd::Last:
      return PlayedPart{part && part->first < at ? part->first : 0, at};
    case PartEnd::None:
      break;
  }
  return std::nullopt;
}

void ViewState::follow(const Touch& touch, double longest_side_mm) {
  constexpr double kSmallest_mm = 0.05;  // below it a resting pad would show only noise
  constexpr int64_t kPatience_ns = 8'000'000'000;
  if (automatic_range && touch.surface) {
    const double wanted_mm = scale_ceiling(std::max(touch.surface->depth_max_mm, kSmallest_mm));
    if (wanted_mm > range_mm) range_mm = wanted_mm;
    // A pad at rest says nothing about the next touch: only a lasting lighter contact narrows the range.
    if (!touch.contact || wanted_mm >= range_mm) {
      smaller_ = false;
    } else if (!smaller_) {
      smaller_ = true;
      smaller_since_ns_ = touch.time_ns;
      smaller_peak_mm_ = wanted_mm;
    } else {
      smaller_peak_mm_ = std::max(smaller_peak_mm_, wanted_mm);
      if (touch.time_ns - smaller_since_ns_ > kPatience_ns) {
        range_mm = smaller_peak_mm_;
        smaller_ = false;
      }
    }
  }
  if (automatic_exaggeration) {
    constexpr double kRelief = 0.17;  // deepest colour, as a fraction of the pad's longest side
    const double wanted = kRelief * longest_side_mm / range_mm;
    exaggeration = std::clamp(scale_ceiling(0.8 * wanted), 1.0, 200.0);
  }
}

void ViewState::choose(const ViewSettings& settings) {
  ViewSettings::operator=(settings);
  replace_hidden();
}

ViewSettings ViewState::chosen(const ViewSettings& before) const {
  ViewSettings now = *this;
  if (!can_show(before.quantity)) now.quantity = before.quantity;
  if (!can_show_skin) now.skin_strain = before.skin_strain;
  return now;
}

void ViewState::replace_hidden() {
  if (!can_show(quantity)) quantity = Quantity::Depth;
  if (!can_show_skin) skin_strain = SkinStrain::Off;
}

bool ViewState::can_show(Quantity shown) const {
  switch (shown) {
    case Quantity::Pressure:
      return can_show_pressure;
    case Quantity::Strain:
      return can_show_strain;
    case Quantity::Friction:
      return can_show_friction;
    default:
      return true;
  }
}

void ViewState::next_quantity() {
  do {
    quantity = static_cast<Quantity>((static_cast<int>(quantity) + 1) % kQuantities);
  } while (!can_show(quantity));
}

bool* ViewState::automatic() {
  if (quantity == Quantity::Strain || quantity == Quantity::Friction) return nullptr;
  return quantity == Quantity::Pressure ? &automatic_pressure : &automatic_range;
}

void ViewState::widen_range(double factor) {
  if (bool* follows = automatic()) *follows = false;
  switch (quantity) {
    case Quantity::Pressure:
      range_MPa = std::clamp(range_MPa * factor, kLeastRange_MPa, kMostRange_MPa);
      break;
    case Quantity::Strain:
      strain_range = std::clamp(strain_range * factor, kLeastStrain, kMostStrain);
      break;
    case Quantity::Friction:
      friction_range = std::clamp(friction_range * factor, kLeastFriction, kMostFriction);
      break;
    default:
      range_mm = std::clamp(range_mm * factor, kLeastRange_mm, kMostRange_mm);
  }
}

void ViewState::change_chart_span(int steps) {
  chart_view.reset();
  if (replay && whole_recording) {
    whole_recording = steps >= 0;
    return;
  }
  const auto at = std::min_element(kChartSpans_s.begin(), kChartSpans_s.end(), [this](double a, double b) {
    return std::abs(a - chart_span_s) < std::abs(b - chart_span_s);
  });
  const auto last = static_cast<int>(kChartSpans_s.size()) - 1;
  const int wanted = static_cast<int>(at - kChartSpans_s.begin()) + steps;
  whole_recording = wanted > last || !replay;
  chart_span_s = kChartSpans_s[static_cast<size_t>(std::clamp(wanted, 0, last))];
}

void ViewState::fit_to(const Sensor& sensor) {
  can_show_pressure = reads_pressure(sensor) || sensor.layer.has_value();
  can_show_traction = sensor.layer.has_value();
  can_show_friction = sensor.layer && sensor.skin;
  can_show_skin = sensor.skin.has_value();
  can_show_strain = sensor.reading != SurfaceReading::None && sensor.reading != SurfaceReading::Elastic;
  if (sensor.shear && sensor.shear->friction > 0) friction_range = sensor.shear->friction;
  replace_hidden();
}

void ViewState::follow_pressure(double largest_MPa) {
  if (!automatic_pressure) return;
  const double wanted = scale_ceiling(std::max(largest_MPa, 1e-3));
  // Grows at once; narrows when the touch is far below, so that colours keep their meaning.
  if (wanted > range_MPa || (largest_MPa > 2e-3 && wanted < 0.3 * range_MPa)) range_MPa = wanted;
}

void ViewState::follow_skin_strain(double largest) {
  constexpr double kSmallest = 0.005;  // below it a resting skin would show only noise
  const double wanted = std::min(scale_ceiling(std::max(largest, kSmallest)), kMostStrain);
  if (wanted > skin_strain_range || wanted < 0.2 * skin_strain_range) skin_strain_range = wanted;
}

SurfaceStyle ViewState::style(double longest_side_mm) const {
  SurfaceStyle s;
  s.exaggeration = exaggeration;
  s.range_mm = range_mm;
  s.quantity = quantity;
  s.map = map;
  s.colour_range = quantity == Quantity::Pressure   ? range_MPa
                   : quantity == Quantity::Friction ? friction_range
                                                    : strain_range;
  s.grid_mm = grid ? nice_ceiling(longest_side_mm / 20) : 0;
  s.lit = lit;
  return s;
}

}  // namespace palpate::viz

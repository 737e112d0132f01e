#include "engine/lump/fem_inverse/ratio_walk.h"

#include <algorithm>
#include <cmath>

namespace palpate::lump {
namespace {

constexpr uint32_t kMostRelaxing = 4, kMostEmulatedSteps = 12, kMostTimesAsked = 6,
                   kMostWholeBlocks = 3;  // off the middle, at four times the cost
constexpr double kLeastStep = kAlongRatio.low / 2;
constexpr double kBeyond = 1.05;   // the end that a line expects, so that a step passes it
constexpr double kFurthest = 4;    // times the way that is known, where a line leads beyond it
constexpr double kNearEnd = 0.85;  // of the rise that ends an interval, from which on a line leads to it

bool any_ratio(const Case::Lump& lump) {
  return lump.stiffness_ratio <= kAnyRatios.low || lump.stiffness_ratio >= kAnyRatios.high;
}

}  // namespace

DirectSearch::RatioWalk::RatioWalk(DirectSearch& search, const State& best, double direction, double allowed,
                                   double step)
    : search_(search),
      best_(best),
      direction_(direction),
      wanted_(std::sqrt(allowed)),
      step_(step),
      least_(search.solve(best, 0, Sought::LumpOfThisRatio).chi2) {}

DirectSearch::RatioWalk::Place DirectSearch::RatioWalk::relaxed(State state) const {
  for (uint32_t round = 0; round < kMostRelaxing; ++round) {
    const Step rest = search_.solve(state, 0, Sought::LumpOfThisRatio);
    if (state.chi2 - rest.chi2 < kNoEmulatedGain) break;
    std::optional<State> next = search_.moved_to(search_.moved(state.lump, shortened(rest.change)), state);
    if (!next || next->chi2 >= state.chi2) break;
    state = std::move(*next);
  }
  const double risen = std::sqrt(std::max(0.0, state.chi2 - least_));
  return {std::move(state), risen};
}

bool DirectSearch::RatioWalk::lower(const State& state) const {
  return state.chi2 < best_.chi2 - kLower;
}

Case::Lump DirectSearch::RatioWalk::crossing(const Place& from, const Place& to) const {
  const double part = to.risen > from.risen ? (wanted_ - from.risen) / (to.risen - from.risen) : 1;
  return search_.moved(from.state.lump, difference(to.state.lump, from.state.lump) * part);
}

Case::Lump DirectSearch::RatioWalk::on_line(const State& through, double times) const {
  return search_.moved(best_.lump, difference(through.lump, best_.lump) * times);
}

std::optional<DirectSearch::State> DirectSearch::RatioWalk::expected_end(Place here) {
  for (uint32_t round = 0; round < kMostEmulatedSteps && !any_ratio(here.state.lump); ++round) {
    step_ = std::clamp(step_, kLeastStep, kAlongRatio.high);
    const double ratio = here.state.lump.stiffness_ratio;
    LumpStep way = search_.solve(here.state, 0, Sought::Lump).by_ratio * (direction_ * step_);
    way(kLnRatio) =
        std::clamp(way(kLnRatio), std::log(kAnyRatios.low / ratio), std::log(kAnyRatios.high / ratio));
    std::optional<State> next = search_.moved_to(search_.moved(here.state.lump, shortened(way)), here.state);
    if (!next) break;
    Place there = relaxed(std::move(*next));
    if (there.risen >= wanted_) return search_.moved_to(crossing(here, there), there.state);
    if (there.risen > here.risen)
      step_ = kBeyond * (wanted_ - there.risen) *
              std::abs(std::log(there.state.lump.stiffness_ratio / ratio)) / (there.risen - here.risen);
    here = std::move(there);
  }
  return std::move(here.state);
}

std::optional<DirectSearch::RatioWalk::Place> DirectSearch::RatioWalk::ask(State at) {
  const bool asked = search_.cells_match(at) ? search_.press(at, AskedGrids::Searched) : search_.correct(at);
  if (!asked) return std::nullopt;
  Place there = relaxed(std::move(at));
  if (there.risen > kNearEnd * wanted_ || any_ratio(there.state.lump) || lower(there.state)) {
    if (!search_.press(there.state, AskedGrids::All)) return std::nullopt;
    there = relaxed(std::move(there.state));
  }
  return there;
}

DirectSearch::RatioEnd DirectSearch::RatioWalk::end() {
  const double all_ratios = std::log(kRatioRange.high / kRatioRange.low);
  RatioEnd end{search_.moved(best_.lump, LumpStep::Unit(kLnRatio) * (direction_ * all_ratios)), std::nullopt};
  Place pressed{best_, 0};
  const uint32_t most =
      best_.cells.in_middle(search_.options_.model.cells) ? kMostTimesAsked : kMostWholeBlocks;
  for (uint32_t asked = 0; asked < most; ++asked) {
    std::optional<State> expected = expected_end(pressed);
    std::optional<Place> there = expected ? ask(std::move(*expected)) : std::nullopt;
    if (!there) break;
    if (lower(there->state)) {
      end.lower = std::move(there->state);
      break;
    }
    if (there->risen >= wanted_) {
      end.lump = crossing(pressed, *there);
      break;
    }
    if (any_ratio(there->state.lump)) break;
    // Where no more is asked, a line leads on.
    end.lump = on_line(there->state, std::min(kFurthest, wanted_ / std::max(there->risen, 1e-9)));
    if (there->risen > kNearEnd * wanted_) break;
    search_.lean_on({asked_of(pressed.state)}, there->state);
    search_.emulate(there->state);
    search_.judge(there->state);
    pressed = std::move(*there);
  }
  return end;
}

DirectSearch::RatioEnd DirectSearch::ratio_end(const State& best, double direction, double allowed,
                                               double step) {
  return best.emulated() ? RatioWalk(*this, best, direction, allowed, step).end()
                         : ratio_end_by_elements(best, direction, allowed, step);
}

}  // namespace palpate::lump

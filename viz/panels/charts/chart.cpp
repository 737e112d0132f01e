#include "viz/panels/charts/chart.h"

#include <cmath>

#include "engine/measure/quantities.h"
#include "viz/render/format.h"
#include "viz/render/view_state.h"

namespace palpate::viz {

double tick_step(double least, double most, int ticks) {
  double step = nice_ceiling((most - least) / std::max(ticks, 1));
  while (step > std::max(most, -least)) step = nice_ceiling(step / 2.5);
  return step;
}

std::optional<std::pair<double, double>> interval(const Estimate& e) {
  if (!has_value(e) || !std::isfinite(e.value)) return std::nullopt;
  return Chart::Ends{e.value - 2 * e.standard_error, e.value + 2 * e.standard_error};
}

void AxisRange::take(double value) {
  if (!std::isfinite(value)) return;
  least = std::min(least, value);
  most = std::max(most, value);
}

double AxisRange::round(double smallest, int ticks) {
  const double length = std::max(most - least, smallest);
  most = scale_ceiling(std::max(1.05 * most, least < 0 ? 0.1 * length : length));
  const double step = tick_step(least, most, ticks);
  // Noise below zero does not cost a whole tick of room.
  least = least < -0.02 * length ? std::max(1.05 * least, std::floor(least / step) * step) : 0;
  if (most - least < smallest) most = least + smallest;
  return step;
}

void Chart::paper(double step) const {
  list_->AddRectFilled(low_, high_, ink(theme().chart));
  const auto first = static_cast<int>(std::ceil(least_ / step - 1e-9));
  const auto last = static_cast<int>(std::floor(most_ / step + 1e-9));
  // No number over another: of close ones every second, or third, counted from zero.
  const double row = ImGui::GetFontSize(), apart = step / (most_ - least_) * double(high_.y - low_.y);
  const int stride = std::max(1, static_cast<int>(std::ceil(0.9 * row / std::max(apart, 1e-3))));
  for (int i = first; i <= last; ++i) {
    const float y = at(end_s_, i * step).y;
    list_->AddLine({low_.x, y}, {high_.x, y}, i == 0 ? ink(theme().frame) : ink(theme().grid));
    if (i % stride != 0) continue;
    const std::string label = tick_text(i * step, step);
    const ImVec2 size = ImGui::CalcTextSize(label.c_str());
    list_->AddText(
        {low_.x - size.x - 4 * scale_, std::clamp(y - size.y / 2, low_.y - 2, high_.y - size.y + 2)},
        ink(theme().faint), label.c_str());
  }
}

void Chart::title(const std::string& whole, ImU32 colour) {
  const float room = high_.x - low_.x - titled_ - noted_;
  if (titled_ > 0 && ImGui::CalcTextSize(whole.c_str()).x > room) return;  // the first words matter most
  const std::string words = shortened(whole, room);
  list_->AddText({low_.x + titled_, low_.y - ImGui::GetFontSize() - scale_}, colour, words.c_str());
  titled_ += ImGui::CalcTextSize(words.c_str()).x + 10 * scale_;
}

void Chart::note(const std::string& words, ImU32 colour) {
  const float width = ImGui::CalcTextSize(words.c_str()).x;
  if (noted_ > 0 || width > high_.x - low_.x - titled_) return;
  noted_ = width + 10 * scale_;
  list_->AddText({high_.x - width, low_.y - ImGui::GetFontSize() - scale_}, colour, words.c_str());
}

void Chart::level(double value, ImU32 colour) const {
  if (value < least_ || value > most_) return;
  const float y = at(end_s_, value).y;
  for (float x = low_.x; x < high_.x; x += 9 * scale_)
    list_->AddLine({x, y}, {std::min(x + 5 * scale_, high_.x), y}, colour);
}

void Chart::time_ticks(const char* title, Ends covered) const {
  const auto is_covered = [&](float left, float right) {
    return left < static_cast<float>(covered.second) && static_cast<float>(covered.first) < right;
  };
  const float title_left = high_.x - ImGui::CalcTextSize(title).x, y = low_.y + 4 * scale_;
  if (!is_covered(title_left, high_.x)) list_->AddText({title_left, y}, ink(theme().faint), title);
  const double step = nice_ceiling(span_s_ / std::max(2.0, double(high_.x - low_.x) / (70.0 * scale_)));
  for (double t = std::ceil((end_s_ - span_s_) / step) * step; t <= end_s_ + 1e-9; t += step) {
    const float x = at(t, 0).x;
    list_->AddLine({x, low_.y}, {x, low_.y + 3 * scale_}, ink(theme().frame));
    const std::string label = tick_text(t, step);
    const float half = ImGui::CalcTextSize(label.c_str()).x / 2;
    if (x + half > title_left - 6 * scale_ || is_covered(x - half, x + half)) continue;
    list_->AddText({x - half, y}, ink(theme().faint), label.c_str());
  }
}

}  // namespace palpate::viz

#include "viz/panels/chart.h"

#include <cmath>

#include "viz/panels/measurement.h"
#include "viz/render/format.h"

namespace palpate::viz {

void Chart::paper(double step) const {
  list_->AddRectFilled(low_, high_, kPaper);
  const auto first = static_cast<int>(std::ceil(least_ / step - 1e-9));
  const auto last = static_cast<int>(std::floor(most_ / step + 1e-9));
  // No number over another: of close ones every second, or third, counted from zero.
  const double row = ImGui::GetFontSize(), apart = step / (most_ - least_) * double(high_.y - low_.y);
  const int stride = std::max(1, static_cast<int>(std::ceil(0.9 * row / std::max(apart, 1e-3))));
  for (int i = first; i <= last; ++i) {
    const float y = at(end_s_, i * step).y;
    list_->AddLine({low_.x, y}, {high_.x, y}, i == 0 ? kFrameLine : kGridLine);
    if (i % stride != 0) continue;
    const std::string label = tick_text(i * step, step);
    const ImVec2 size = ImGui::CalcTextSize(label.c_str());
    list_->AddText(
        {low_.x - size.x - 4 * scale_, std::clamp(y - size.y / 2, low_.y - 2, high_.y - size.y + 2)}, kFaint,
        label.c_str());
  }
}

void Chart::title(const std::string& whole, ImU32 colour, float right) const {
  const std::string words = shortened(whole, high_.x - low_.x - 10 * scale_);
  const ImVec2 size = ImGui::CalcTextSize(words.c_str());
  if (right > 0 && low_.x + right + size.x > high_.x) return;  // the first words are the ones that matter
  const ImVec2 place{low_.x + 5 * scale_ + right, low_.y + 1 * scale_};
  list_->AddRectFilled({place.x - 2, place.y}, {place.x + size.x + 2, place.y + size.y},
                       IM_COL32(26, 30, 36, 200));
  list_->AddText(place, colour, words.c_str());
}

void Chart::level(double value, ImU32 colour, const std::string& label) const {
  if (value < least_ || value > most_) return;
  const float y = at(end_s_, value).y;
  for (float x = low_.x; x < high_.x; x += 9 * scale_)
    list_->AddLine({x, y}, {std::min(x + 5 * scale_, high_.x), y}, colour);
  const ImVec2 size = ImGui::CalcTextSize(label.c_str());
  const float above = y - size.y - 1 < low_.y ? y + 1 : y - size.y - 1;
  list_->AddText({high_.x - size.x - 4 * scale_, above}, colour, label.c_str());
}

void Chart::line(const std::deque<Sample>& samples, const std::function<bool(const Sample&, double&)>& value,
                 ImU32 colour, LineStyle line_style) const {
  StyledLine drawn(list_, colour, line_style, scale_);
  ImVec2 last{};
  bool joined = false;
  for (const Sample& s : samples) {
    double v = 0;
    if (!visible(s.time) || !value(s, v) || !std::isfinite(v)) {
      joined = false;
      continue;
    }
    const ImVec2 p = at(s.time, v);
    if (s.gap) joined = false;
    if (joined && p.x - last.x < 1 && std::abs(p.y - last.y) < 1) continue;
    if (joined) drawn.piece(last, p);
    last = p;
    joined = true;
  }
}

void Chart::band(const std::deque<Sample>& samples,
                 const std::function<bool(const Sample&, double&, double&)>& ends, ImU32 colour) const {
  ImVec2 low{}, high{};
  bool joined = false;
  for (const Sample& s : samples) {
    double least = 0, most = 0;
    if (!visible(s.time) || !ends(s, least, most)) {
      joined = false;
      continue;
    }
    const ImVec2 a = at(s.time, least), b = at(s.time, most);
    if (s.gap) joined = false;
    if (joined && a.x - low.x < 1) continue;
    if (joined) list_->AddQuadFilled(high, b, a, low, colour);
    low = a;
    high = b;
    joined = true;
  }
}

}  // namespace palpate::viz

#include "viz/panels/charts/chart.h"

#include <cmath>

#include "viz/render/format.h"

namespace palpate::viz {

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

void Chart::line(const std::deque<Sample>& samples,
                 const std::function<std::optional<double>(const Sample&)>& value, ImU32 colour,
                 LineStyle line_style) const {
  StyledLine drawn(list_, colour, line_style, scale_);
  ImVec2 last{};
  bool joined = false, alone = false;
  const auto end_piece = [&] {
    if (alone) list_->AddCircleFilled(last, 1.5f * scale_, colour);
    joined = alone = false;
  };
  for (const Sample& s : samples) {
    const std::optional<double> v = visible(s.time) ? value(s) : std::nullopt;
    if (!v || !std::isfinite(*v)) {
      end_piece();
      continue;
    }
    const ImVec2 p = at(s.time, *v);
    if (s.gap) end_piece();
    if (joined && p.x - last.x < 1 && std::abs(p.y - last.y) < 1) continue;
    if (joined) drawn.piece(last, p);
    alone = !joined;
    last = p;
    joined = true;
  }
  end_piece();
}

void Chart::band(const std::deque<Sample>& samples,
                 const std::function<std::optional<Ends>(const Sample&)>& ends, ImU32 colour) const {
  ImVec2 low{}, high{};
  bool joined = false;
  for (const Sample& s : samples) {
    const std::optional<Ends> both = visible(s.time) ? ends(s) : std::nullopt;
    if (!both) {
      joined = false;
      continue;
    }
    const ImVec2 a = at(s.time, both->first), b = at(s.time, both->second);
    if (s.gap) joined = false;
    if (joined && a.x - low.x < 1) continue;
    if (joined) list_->AddQuadFilled(high, b, a, low, colour);
    low = a;
    high = b;
    joined = true;
  }
}

}  // namespace palpate::viz

#include "viz/panels/numbers/cards.h"

#include <algorithm>

#include "viz/look/measures.h"
#include "viz/render/drawing.h"

namespace palpate::viz {
namespace {

/// How close the rows of all cards are.
struct Density {
  bool small;       ///< letters
  bool pairs;       ///< two short rows share a line
  bool titles;      ///< of all cards, not of the first alone
  float rows_px;    ///< between rows, at scale 1
  float within_px;  ///< around what a card holds, and between cards
};
constexpr Density kDensities[] = {{false, false, true, kGrid_px / 2, kGrid_px},
                                  {false, false, true, kGrid_px / 8, kGrid_px / 2},
                                  {false, true, true, kGrid_px / 8, kGrid_px / 2},
                                  {true, true, true, kGrid_px / 4, kGrid_px / 2},
                                  {true, true, true, 0, kGrid_px / 4},
                                  {true, true, false, 0, kGrid_px / 4}};

/// Measures and draws cards of one width and density; the present font is that of the density.
class CardPainter {
 public:
  CardPainter(const HudFrame& frame, const Density& density, float width)
      : frame_(frame), scale_(frame.scale()), density_(density), width_(width) {}

  float height(const std::vector<Card>& cards) const {
    float sum = 0;
    for (const Card& card : cards) sum += height(card) + density_.within_px * scale_;
    return sum;
  }
  void draw(const Card& card) const {
    const ImVec2 low = ImGui::GetCursorScreenPos(), size{width_, height(card)};
    ImGui::GetWindowDrawList()->AddRectFilled(low, {low.x + size.x, low.y + size.y}, ink(theme().panel),
                                              kGrid_px / 2 * scale_);
    const float pad = density_.within_px * scale_;
    ImVec2 at{low.x + pad + kGrid_px / 2 * scale_, low.y + pad};
    if (has_title(card)) title(card, at);
    at.y += title_height(card);
    if (card.above_px > 0) {
      const float height = card.above_px * scale_;
      card.draw(at, {at.x + inner(), at.y + height});
      at.y += height + density_.rows_px * scale_;
    }
    if (card.beside_px > 0) {
      const float side = beside(card);
      card.draw(at, {at.x + side, at.y + side});
    }
    const float left = at.x + inner() - room(card);
    for (size_t i = 0; i < card.rows.size(); ++i) {
      const float height_here = height(card.rows[i], room(card));
      if (paired(card, i)) {
        row(card.rows[i++], {left, at.y}, half(card));
        row(card.rows[i], {left + room(card) - half(card), at.y}, half(card));
      } else {
        row(card.rows[i], {left, at.y}, room(card));
      }
      at.y += height_here;
    }
    ImGui::SetCursorScreenPos(low);
    ImGui::Dummy(size);
    ImGui::SetCursorScreenPos({low.x, low.y + size.y + density_.within_px * scale_});
  }

 private:
  float inner() const { return width_ - 2 * (density_.within_px + kGrid_px / 2) * scale_; }
  float room(const Card& card) const {
    return inner() - (card.beside_px > 0 ? beside(card) + kGrid_px * scale_ : 0);
  }
  /// Side of the drawing beside the rows.
  float beside(const Card& card) const { return card.beside_px * scale_ * (density_.small ? 0.75f : 1); }
  bool has_title(const Card& card) const { return density_.titles || card.above_px > 0; }
  float title_height(const Card& card) const {
    return has_title(card) ? frame_.small()->FontSize + density_.rows_px * scale_ : 0;
  }
  float half(const Card& card) const { return room(card) / 2 - kGrid_px * scale_; }
  bool paired(const Card& card, size_t i) const {
    return density_.pairs && i + 1 < card.rows.size() && one_line(card.rows[i], half(card)) &&
           one_line(card.rows[i + 1], half(card));
  }
  bool one_line(const CardRow& row, float room) const {
    return !row.label.empty() && ImGui::CalcTextSize(row.label.c_str()).x + kGrid_px * scale_ +
                                         ImGui::CalcTextSize(row.words.c_str()).x <=
                                     room;
  }
  float height(const CardRow& row, float room) const {
    float lines = ImGui::GetFontSize();
    if (!one_line(row, room))
      lines =
          ImGui::CalcTextSize(row.words.c_str(), nullptr, false, room).y + (row.label.empty() ? 0 : lines);
    return lines + density_.rows_px * scale_;
  }
  float height(const Card& card) const {
    float rows = 0;
    for (size_t i = 0; i < card.rows.size(); ++i) {
      rows += height(card.rows[i], room(card));
      if (paired(card, i)) ++i;
    }
    if (card.beside_px > 0) rows = std::max(rows, beside(card) + density_.rows_px * scale_);
    if (card.above_px > 0) rows += (card.above_px + density_.rows_px) * scale_;
    return title_height(card) + rows + (2 * density_.within_px - density_.rows_px) * scale_;
  }
  void title(const Card& card, ImVec2 at) const {
    ImGui::PushFont(frame_.small());
    ImGui::SetCursorScreenPos(at);
    ImGui::TextUnformatted(card.title.c_str());
    if (!card.aside.empty()) {
      ImGui::SetCursorScreenPos({at.x + inner() - ImGui::CalcTextSize(card.aside.c_str()).x, at.y});
      ImGui::TextDisabled("%s", card.aside.c_str());
    }
    ImGui::PopFont();
  }
  void row(const CardRow& row, ImVec2 at, float room) const {
    const bool one = one_line(row, room);
    if (!row.label.empty()) {
      ImGui::SetCursorScreenPos(at);
      ImGui::TextDisabled("%s", row.label.c_str());
      const float slack = room - ImGui::CalcTextSize(row.words.c_str()).x;
      at = {at.x + std::max(slack, 0.0f), at.y + (one ? 0 : ImGui::GetFontSize())};
      room -= std::max(slack, 0.0f);
    }
    ImGui::SetCursorScreenPos(at);
    // A little more than measured: rounding must not break a line that fits.
    ImGui::PushTextWrapPos(ImGui::GetCursorPosX() + room + 1);
    ImGui::PushStyleColor(ImGuiCol_Text, tint(theme().of(row.meaning)));
    ImGui::TextUnformatted(row.words.c_str());
    ImGui::PopStyleColor();
    ImGui::PopTextWrapPos();
  }

  const HudFrame& frame_;
  float scale_;
  Density density_;
  float width_;
};

}  // namespace

void begin_panel(const char* name, const ViewRect& rect, float scale) {
  ImGui::SetNextWindowPos(corner(rect));
  ImGui::SetNextWindowSize(size_of(rect));
  ImGui::PushStyleVar(ImGuiStyleVar_WindowRounding, 0);
  ImGui::PushStyleVar(ImGuiStyleVar_WindowPadding, {kGrid_px * scale, kGrid_px * scale});
  ImGui::Begin(name, nullptr,
               ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoSavedSettings |
                   ImGuiWindowFlags_NoBackground | ImGuiWindowFlags_NoBringToFrontOnFocus |
                   ImGuiWindowFlags_NoNav);
  ImGui::PopStyleVar(2);
}

void draw_cards(const HudFrame& frame, const std::vector<Card>& cards) {
  const ImVec2 room = ImGui::GetContentRegionAvail();
  for (const Density& density : kDensities) {
    if (density.small) ImGui::PushFont(frame.small());
    const CardPainter painter(frame, density, room.x);
    const bool last = &density == std::end(kDensities) - 1, fits = painter.height(cards) <= room.y;
    if (fits || last)
      for (const Card& card : cards) painter.draw(card);
    if (density.small) ImGui::PopFont();
    if (fits || last) return;
  }
}

}  // namespace palpate::viz

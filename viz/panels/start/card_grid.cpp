#include "viz/panels/start/card_grid.h"

#include <imgui.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "viz/render/drawing.h"
#include "viz/render/format.h"

namespace palpate::viz {
namespace {

constexpr float kLeastWidth = 150, kGap = 8, kInner = 6;  // at scale 1

/// A block of tissue with a lump in it.
void draw_lump(ImDrawList& list, ImVec2 low, ImVec2 high, float scale) {
  const ImVec2 size{high.x - low.x, high.y - low.y};
  list.AddRectFilled(low, high, ink(theme().chart));
  const ImVec2 block_low{low.x + 0.15f * size.x, low.y + 0.3f * size.y};
  const ImVec2 block_high{high.x - 0.15f * size.x, high.y - 0.12f * size.y};
  list.AddRectFilled({block_low.x - 8 * scale, block_low.y - 8 * scale},
                     {block_high.x + 8 * scale, block_low.y}, ink(theme().frame));
  list.AddRect(block_low, block_high, ink(theme().faint), 0, 0, 1.5f * scale);
  list.AddCircleFilled({(block_low.x + block_high.x) / 2, block_low.y + 0.5f * (block_high.y - block_low.y)},
                       0.11f * size.x, ink(theme().doubtful));
}

/// A picture that is another each time: pictures of the page lie in a texture that is made once.
void draw_pixels(ImDrawList& list, const RgbImage& image, ImVec2 low, ImVec2 high) {
  constexpr uint32_t kAcross = 64, kDown = 48;
  const auto colour = [&](uint32_t column, uint32_t row) {
    const uint8_t* rgb = image.at(column * (image.width - 1) / kAcross, row * (image.height - 1) / kDown);
    return IM_COL32(rgb[0], rgb[1], rgb[2], 255);
  };
  const auto place = [&](uint32_t column, uint32_t row) {
    return ImVec2{low.x + (high.x - low.x) * static_cast<float>(column) / kAcross,
                  low.y + (high.y - low.y) * static_cast<float>(row) / kDown};
  };
  for (uint32_t y = 0; y < kDown; ++y)
    for (uint32_t x = 0; x < kAcross; ++x)
      list.AddRectFilledMultiColor(place(x, y), place(x + 1, y + 1), colour(x, y), colour(x + 1, y),
                                   colour(x + 1, y + 1), colour(x, y + 1));
}

}  // namespace

float CardGrid::width_for(float content, float scale) {
  const float columns = std::max(1.0f, std::floor((content + kGap * scale) / ((kLeastWidth + kGap) * scale)));
  return std::floor((content + kGap * scale) / columns - kGap * scale);
}

void CardGrid::begin(const HudFrame& frame, float content) {
  frame_ = &frame;
  content_ = content;
  width_ = width_for(content, frame.scale());
  places_.clear();
  row_ = -1;
  x_ = 0;
}

void CardGrid::heading(const char* words) {
  if (row_ >= 0) ImGui::Dummy({1, 4 * frame_->scale()});
  ImGui::TextColored(tint(theme().chosen), "%s", words);
  next_row();
}

void CardGrid::remark(const std::string& words) {
  wrapped_text(words, tint(theme().faint));
  next_row();
}

void CardGrid::next_row() {
  ++row_;
  x_ = 0;
}

CardClick CardGrid::add(const PictureCard& card, bool selected, bool scroll_here, const std::string& tip) {
  const float scale = frame_->scale(), inner = kInner * scale, line = ImGui::GetTextLineHeight();
  if (x_ > 0 && x_ + width_ > content_ + 1) next_row();
  if (x_ > 0) ImGui::SameLine(0, kGap * scale);
  places_.push_back({row_, x_});
  x_ += width_ + kGap * scale;

  const float picture_width = width_ - 2 * inner, picture_height = 0.75f * picture_width;
  const float height = picture_height + 2 * line + 3 * inner;
  ImGui::PushID(static_cast<int>(places_.size()));
  const bool clicked = ImGui::InvisibleButton("card", {width_, height});
  const bool pointed_at = ImGui::IsItemHovered();
  const ImVec2 low = ImGui::GetItemRectMin(), high = ImGui::GetItemRectMax();
  if (scroll_here) ImGui::SetScrollHereY();

  ImDrawList& list = *ImGui::GetWindowDrawList();
  const float round = 6 * scale;
  list.AddRectFilled(low, high, ink(pointed_at ? theme().field : theme().panel), round);
  list.AddRect(low, high, ink(selected ? theme().chosen : theme().frame), round, 0,
               (selected ? 2 : 1) * scale);
  const ImVec2 picture_low{low.x + inner, low.y + inner};
  const ImVec2 picture_high{picture_low.x + picture_width, picture_low.y + picture_height};
  if (card.live)
    draw_pixels(list, *card.live, picture_low, picture_high);
  else if (card.picture)
    frame_->draw_picture(*card.picture, {picture_low.x, picture_low.y}, {picture_high.x, picture_high.y});
  else if (card.lump)
    draw_lump(list, picture_low, picture_high, scale);
  else {
    list.AddRectFilled(picture_low, picture_high, ink(theme().chart));
    const std::string words = shortened(card.instead, picture_width);
    const ImVec2 room = ImGui::CalcTextSize(words.c_str());
    list.AddText(
        {(picture_low.x + picture_high.x - room.x) / 2, (picture_low.y + picture_high.y - room.y) / 2},
        ink(theme().faint), words.c_str());
  }
  const float text_y = picture_high.y + inner;
  const std::string name = shortened(card.name, picture_width),
                    detail = shortened(card.detail, picture_width);
  list.AddText({picture_low.x, text_y}, ink(card.usable ? theme().text : theme().faint), name.c_str());
  list.AddText({picture_low.x, text_y + line}, ink(theme().faint), detail.c_str());
  bool pressed = false;
  if (!card.button.empty()) {
    const float width = ImGui::CalcTextSize(card.button.c_str()).x + 2 * ImGui::GetStyle().FramePadding.x;
    ImGui::SetItemAllowOverlap();
    ImGui::SetCursorScreenPos({picture_high.x - width - inner, picture_low.y + inner});
    pressed = ImGui::SmallButton(card.button.c_str());
    // The next card stands beside this one, not beside the button.
    ImGui::SetCursorScreenPos(low);
    ImGui::Dummy({width_, height});
  }
  ImGui::PopID();
  if (pointed_at && !tip.empty()) {
    ImGui::BeginTooltip();
    ImGui::PushTextWrapPos(std::min(0.9f * ImGui::GetIO().DisplaySize.x, 480 * scale));
    ImGui::TextUnformatted(tip.c_str());
    ImGui::PopTextWrapPos();
    ImGui::EndTooltip();
  }
  return pressed ? CardClick::Button : clicked ? CardClick::Card : CardClick::Nothing;
}

size_t CardGrid::neighbour(size_t from, int right, int down) const {
  if (places_.empty()) return from;
  const auto last = static_cast<int>(places_.size()) - 1;
  const size_t here = std::min(from, static_cast<size_t>(last));
  if (down == 0) return static_cast<size_t>(std::clamp(static_cast<int>(here) + right, 0, last));
  // Rows are numbered with those of headings and remarks, which hold no card.
  std::vector<int> rows;
  for (const Place& place : places_)
    if (rows.empty() || rows.back() != place.row) rows.push_back(place.row);
  const auto at = static_cast<int>(std::ranges::find(rows, places_[here].row) - rows.begin());
  const int row = rows[static_cast<size_t>(std::clamp(at + down, 0, static_cast<int>(rows.size()) - 1))];
  size_t best = here;
  float least = -1;
  for (size_t i = 0; i < places_.size(); ++i) {
    const float way = std::abs(places_[i].x - places_[here].x);
    if (places_[i].row != row || (least >= 0 && way >= least)) continue;
    least = way;
    best = i;
  }
  return best;
}

}  // namespace palpate::viz

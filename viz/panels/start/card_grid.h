// Cards with pictures, in rows that fill the width.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "viz/render/hud_frame.h"

namespace palpate::viz {

struct PictureCard {
  std::string name;
  std::string detail;             ///< one line below the name
  std::optional<size_t> picture;  ///< of the page's
  bool lump = false;              ///< without a picture: a block with a lump is drawn
  bool usable = true;
  const RgbImage* live = nullptr;  ///< in place of the picture
  std::string instead = {};        ///< words where there is no picture
  std::string button = {};         ///< words of a button on the picture; empty: none
};

/// What of a card was clicked.
enum class CardClick { Nothing, Card, Button };

/// Cards of one page, in groups with headings; where each was drawn is known until the next picture.
class CardGrid {
 public:
  /// Of one card for a width of the page's content, px.
  static float width_for(float content, float scale);

  void begin(const HudFrame& frame, float content);
  void heading(const char* words);
  /// `tip`: said where the mouse is, unless empty.
  CardClick add(const PictureCard& card, bool selected, bool scroll_here, const std::string& tip);
  /// A line of words between cards.
  void remark(const std::string& words);

  size_t size() const { return places_.size(); }
  /// The card that lies `right` cards and `down` rows from card `from`, as far as there are any.
  size_t neighbour(size_t from, int right, int down) const;

 private:
  struct Place {
    int row;
    float x;
  };
  void next_row();

  const HudFrame* frame_ = nullptr;
  float content_ = 0, width_ = 0;
  int row_ = -1;
  float x_ = 0;  ///< of the next card, px from the left of the content
  std::vector<Place> places_;
};

}  // namespace palpate::viz

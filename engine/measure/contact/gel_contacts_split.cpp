// Contacts of a gel that one foot joins: separated by their structure, or by the depth between them.
#include <algorithm>

#include "engine/measure/contact/gel_contacts.h"

namespace palpate {
namespace {
constexpr double kCellPixels = shared::kCellSide * shared::kCellSide;
}  // namespace

void GelContacts::split(std::span<const float> depth_mm, double error_mm, std::span<const ContactTouch> gray,
                        std::vector<ContactTouch>& found) {
  std::swap(by_depth_.of_cell, by_depth_.before);
  by_depth_.of_cell = owner_;
  if (basins_.split(depth_mm, error_mm, pixels_, by_depth_.of_cell, by_depth_.owner) == 0) return;
  confirm(by_depth_);
  set_shapes(found);
  add_gray(gray, found);
}

// Where a foot holds outlines of objects that are both large and clear, each is a contact, and the rest of
// the foot goes with the nearest. Fragments of one outline are smaller, or fainter. An object that is
// smoother than the other has its outline far from it, where the other's structure does not count.
bool GelContacts::split_by_structure() {
  find_parts();
  std::swap(by_structure_.of_cell, by_structure_.before);
  std::fill(by_structure_.of_cell.begin(), by_structure_.of_cell.end(), 0u);
  by_structure_.owner.assign(1, 0);
  bool any = false;
  for (uint32_t contact = 1; contact <= count_; ++contact) {
    double largest_px = 0;
    for (const Part& part : parts_)
      if (part.owner == contact) largest_px = std::max(largest_px, part.area_px);
    uint32_t own = 0, first = 0;
    const auto take = [&](Part& part) {
      part.piece = static_cast<uint32_t>(by_structure_.owner.size());
      by_structure_.owner.push_back(contact);
      any = ++own > 1 || any;
    };
    for (uint32_t i = 0; i < parts_.size() && first == 0; ++i)
      if (parts_[i].owner == contact && parts_[i].area_px == largest_px) first = i + 1;
    if (first != 0) take(parts_[first - 1]);
    for (uint32_t i = 0; i < parts_.size(); ++i) {
      Part& part = parts_[i];
      if (part.owner != contact || i + 1 == first) continue;
      if (part.area_px >= std::max(kLargePart * largest_px, least_px_) && is_object(part, parts_[first - 1]))
        take(part);
    }
    if (own == 1 && apart_ > 0) {
      const size_t before = parts_.size();
      find_far_parts(contact, first);
      for (size_t i = before; i < parts_.size(); ++i)
        if (parts_[i].area_px >= far_px_ && is_object(parts_[i], parts_[first - 1])) take(parts_[i]);
    }
    if (own > 0) continue;
    by_structure_.owner.push_back(contact);  // without an outline
    for (size_t i = 0; i < owner_.size(); ++i)
      if (owner_[i] == contact)
        by_structure_.of_cell[i] = static_cast<uint32_t>(by_structure_.owner.size()) - 1;
  }
  edge_.clear();
  for (uint32_t cell = 0; cell < owner_.size(); ++cell) {
    const uint32_t piece = label_[cell] == 0 ? 0 : parts_[label_[cell] - 1].piece;
    if (piece == 0) continue;
    by_structure_.of_cell[cell] = piece;
    edge_.push_back(cell);
  }
  spread_pieces();
  if (count_ > 0) confirm(by_structure_);
  return any;
}

// Parts of a contact's foot that lie apart from the part with label `first`, by their own outline.
void GelContacts::find_far_parts(uint32_t contact, uint32_t first) {
  for (size_t i = 0; i < near_.size(); ++i) near_[i] = label_[i] == first;
  spread(near_, at_rest_, near_, apart_);
  sorted_.clear();
  for (size_t i = 0; i < owner_.size(); ++i)
    if (owner_[i] == contact && near_[i] == 0) sorted_.push_back(strength_[i]);
  const bool room = static_cast<double>(sorted_.size()) * kCellPixels >= far_px_;
  const float level = room ? level_of_sorted() : 0;
  sorted_.resize(pixels_.size());
  if (!room) return;
  for (size_t i = 0; i < owner_.size(); ++i) {
    if (owner_[i] != contact || near_[i] != 0) continue;
    label_[i] = 0;
    foot_[i] = strength_[i] >= level;
  }
  add_parts();
}

// Pieces of one foot whose outlines, each by its own level, turn out to be a band, or one a ring around the
// other, become one again; returns whether there were any.
bool GelContacts::join_what_one_makes() {
  outline_of_.assign(count_ + 1, {});
  for (uint32_t cell = 0; cell < owner_.size(); ++cell)
    if (foot_[cell] != 0 && owner_[cell] != 0)
      outline_of_[owner_[cell]].add(cell % cells_x_, cell / cells_x_);
  number_of_.assign(count_ + 1, 0);
  lineage_of_ = foot_of_;
  foot_of_.assign(1, 0);
  uint32_t count = 0;
  for (uint32_t one = 1; one <= count_; ++one) {
    for (uint32_t other = 1; other < one && number_of_[one] == 0; ++other) {
      const Part &a = outline_of_[one], &b = outline_of_[other];
      if (lineage_of_[one] == lineage_of_[other] &&
          (is_band(a) || is_band(b) || a.surrounds(b) || b.surrounds(a)))
        number_of_[one] = number_of_[other];
    }
    if (number_of_[one] != 0) continue;
    number_of_[one] = ++count;
    foot_of_.push_back(lineage_of_[one]);
  }
  if (count == count_) return false;
  for (uint32_t& owner : owner_) owner = number_of_[owner];
  count_ = count;
  return true;
}

// Whether a part is an object's of its own: clear, and neither a band, nor a ring around the other or within
// one, nor beside a band, all of which one object makes where it covers much of the gel.
bool GelContacts::is_object(const Part& part, const Part& other) const {
  return double{part.strongest} >= kClearPart && !is_band(part) && !is_band(other) &&
         !part.surrounds(other) && !other.surrounds(part);
}

// Whether it reaches across the whole picture and is longer that way than wide: no outline of an object, but
// where the gel around one bulges, or an edge of what covers the picture.
bool GelContacts::is_band(const Part& part) const {
  const double width = part.right - part.left + 1, height = part.bottom - part.top + 1;
  const bool down = part.top == 0 && part.bottom + 1 == cells_y_;
  const bool across = part.left == 0 && part.right + 1 == cells_x_;
  return (down && height > kBand * width) || (across && width > kBand * height);
}

// Connected cells within outlines; label_ is the number in parts_, from 1, that a cell belongs to.
void GelContacts::find_parts() {
  std::fill(label_.begin(), label_.end(), 0u);
  parts_.clear();
  add_parts();
}

void GelContacts::add_parts() {
  for (uint32_t cell = 0; cell < foot_.size(); ++cell) {
    if (foot_[cell] == 0 || owner_[cell] == 0 || label_[cell] != 0) continue;
    flood(cell, static_cast<uint32_t>(parts_.size()) + 1, [this](uint32_t one) { return foot_[one] != 0; });
    Part& part = parts_.emplace_back();
    part.owner = owner_[cell];
    for (const uint32_t one : edge_) {
      part.area_px += double{pixels_[one]};
      part.strongest = std::max(part.strongest, strength_[one]);
      part.add(one % cells_x_, one / cells_x_);
    }
  }
}

// From the cells that edge_ holds over all others of their foot, by steps.
void GelContacts::spread_pieces() {
  std::vector<uint32_t>& piece = by_structure_.of_cell;
  for (size_t next = 0; next < edge_.size(); ++next) {
    const uint32_t cell = edge_[next], x = cell % cells_x_, y = cell / cells_x_;
    const auto visit = [&](uint32_t to) {
      if (owner_[to] != owner_[cell] || piece[to] != 0) return;
      piece[to] = piece[cell];
      edge_.push_back(to);
    };
    if (x > 0) visit(cell - 1);
    if (x + 1 < cells_x_) visit(cell + 1);
    if (y > 0) visit(cell - cells_x_);
    if (y + 1 < cells_y_) visit(cell + cells_x_);
  }
}

// Contacts that were one in the last frame stay one in this: a split has to be seen twice.
void GelContacts::confirm(const Pieces& pieces) {
  seen_piece_.assign(count_ + 1, 0);
  confirmed_.assign(count_ + 1, frames_ <= 1 ? 1 : 0);
  for (size_t i = 0; i < owner_.size(); ++i) {
    const uint32_t contact = owner_[i], before = pieces.before[i];
    if (contact == 0 || before == 0) continue;
    if (seen_piece_[contact] == 0) seen_piece_[contact] = before;
    if (seen_piece_[contact] != before) confirmed_[contact] = 1;
  }
  // A contact that did not split is its first piece.
  std::fill(seen_piece_.begin(), seen_piece_.end(), 0u);
  number_of_.assign(pieces.owner.size(), 0);
  lineage_of_ = foot_of_;
  foot_of_.assign(1, 0);
  uint32_t count = 0;
  for (uint32_t piece = 1; piece < pieces.owner.size(); ++piece) {
    const uint32_t contact = pieces.owner[piece];
    if (confirmed_[contact] != 0 || seen_piece_[contact] == 0) {
      seen_piece_[contact] = ++count;
      foot_of_.push_back(lineage_of_[contact]);
      number_of_[piece] = count;
    } else {
      number_of_[piece] = seen_piece_[contact];
    }
  }
  for (size_t i = 0; i < owner_.size(); ++i)
    if (owner_[i] != 0) owner_[i] = number_of_[pieces.of_cell[i]];
  count_ = count;
}

}  // namespace palpate

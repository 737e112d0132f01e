// Contacts of a colour gel: regions where the image, and so the slope, changes by more than its noise.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "engine/measure/contact/contact_shape.h"
#include "engine/measure/contact/depth_basins.h"
#include "engine/measure/picture/light_change.h"
#include "palpate/frame.h"
#include "palpate/sensor.h"
#include "palpate/touch.h"
#include "shaders/shared/cell_change.h"

namespace palpate {

/// A gel shows slopes: a threshold on the change of its image breaks one contact into rings and specks. This
/// class uses the mean square change of cells of 4 x 4 px, divided by its value in untouched frames. Each
/// cell's ratio is limited to kCap, so that a speck is not a contact, and smoothed over kReach_mm, so that a
/// ring and its centre belong together; a closed ring is filled where nothing else begins a contact, for a
/// flat face with a sharp edge shows no more. A contact is a connected region above kFoot, with its holes,
/// that reaches kSureOnset in one frame or kOnset in two; a contact of the frame before needs kCore. Its
/// outline is where the local variance of the image falls to kOutline of the contact's own, since light that
/// glows through the gel is smooth: accurate to about 1.5 mm.
///
/// The noise of each cell is learned while the cell is not touched. A change of the light is estimated for
/// each colour from the cells that are not touched, and subtracted first.
class GelContacts {
 public:
  static constexpr double kReach_mm = 1.6;   ///< standard deviation of the weights
  static constexpr double kCap = 8;          ///< a cell counts no more than this, over its noise
  static constexpr double kFoot = 2;         ///< mean over noise from which a cell belongs to a contact
  static constexpr double kOnset = 4;        ///< that a new contact has to reach somewhere
  static constexpr double kSureOnset = 6;    ///< likewise; with less it has to do so in two frames
  static constexpr double kCore = 3;         ///< that one has to reach to go on
  static constexpr double kOutline = 0.2;    ///< of the structure's 95th percentile over the contact
  static constexpr double kLargePart = 0.6;  ///< of the largest outline's area: another object's
  static constexpr double kApart_mm = 10;    ///< from that outline: there another object is found by itself,
  static constexpr double kLeastApart_mm2 = 53;  ///< if its outline is so large
  static constexpr double kClearPart = 6;        ///< of its structure over the noise
  static constexpr double kFaint = 2;  ///< structure of what is no contact at the border, next to one whose
  static constexpr double kClearer = 2.5;  ///< structure is so many times as strong
  static constexpr double kBand = 1.25;    ///< length over width of what reaches across the picture
  static constexpr double kLeast_mm2 = 2;  ///< area of a contact's foot
  static constexpr double kLeastRing = 4;  ///< of that, within a closed rim alone
  static constexpr double kRestMargin_mm = 2;
  static constexpr double kDented = 0.1;  ///< of the deepest point, from which the pad counts as dented
  static constexpr uint32_t kMostContacts = 64;

  /// Frames of three colours and 8 bits.
  GelContacts(const Sensor& sensor, const FrameFormat& format);

  void set_background(const Frame& background);
  /// Forgets the frames so far: the next is as the first one after the untouched image.
  void restart();

  /// One frame's contacts, frames in order: `cells` row by row. Others' sums of its gray, `gray`, are given
  /// to the contact that each lies in; what lies in none is left out. Fills `found` with shapes only.
  void find(std::span<const shared::CellChange> cells, std::span<const ContactTouch> gray,
            std::vector<ContactTouch>& found);
  /// A foot joins contacts that the pad's slope between them does not separate: those of the last frame are
  /// split by their depth, as DepthBasins does. `depth_mm`: mean of each cell, 0 at rest; `error_mm`: of
  /// them, as far as is known.
  void split(std::span<const float> depth_mm, double error_mm, std::span<const ContactTouch> gray,
             std::vector<ContactTouch>& found);
  /// The area in contact of each contact that the last call of split() left, in place of its outline: what
  /// lies deeper than the level at which the sides of its dent are steepest, since a pad follows an object as
  /// far as they touch and rises less steeply beyond (Hertz). Area, centroid and ellipse are then its; box
  /// and border are those of both, and the outline stays where the dent does not stand out of the noise.
  /// Arguments as of split().
  void shrink_to_depth(std::span<const float> depth_mm, std::span<const ContactTouch> gray,
                       std::vector<ContactTouch>& found);
  /// The pad where it lies deeper than kDented of the deepest point and than three times the noise at rest.
  struct Dent {
    double noise_mm = 0;             ///< RMS of the heights where the pad is at rest, whose mean is 0
    std::optional<double> level_mm;  ///< depth from which the pad counts as dented; none without a contact
    double area_px = 0;
  };
  Dent dent(std::span<const float> depth_mm) const;
  /// The contact that a cell of the last frame lies in, from 1 in the order of `found`; 0: in none.
  uint32_t contact_of(size_t cell) const { return foot_[cell] != 0 ? owner_[cell] : 0; }
  uint32_t count() const { return count_; }
  /// All contacts of the last frame as one shape; area 0 without any.
  const ContactTouch& whole() const { return whole_; }
  /// Whether each cell of the last frame is surely not touched: kRestMargin_mm from any contact's outline.
  std::span<const uint8_t> at_rest() const { return at_rest_; }
  /// From now on, for the last frame, only where the image has not changed either, and not within what has:
  /// an even face leaves slopes at its rim alone.
  void rest_where_unchanged();
  /// Mean square change of each cell of the last frame over its noise, smoothed.
  std::span<const float> raised() const { return raised_; }
  /// Mean change of red, green and blue of each cell of the last frame, gray levels.
  const std::array<std::vector<float>, 3>& mean_change() const { return means_; }
  /// Red, green and blue of the last frame.
  const std::array<LightChange, 3>& light() const { return light_; }
  /// Whether enough of the last frame was untouched to estimate them.
  bool light_known() const { return light_known_; }
  /// Whether enough of it was, see LightTrust: else the untouched image may be another pad's.
  bool light_trusted() const { return light_trusted_; }
  /// Whether a colour of the last frame is under another light: by more than a twentieth of the untouched
  /// image's mean, and than a touch may have pulled it.
  bool other_light() const;

 private:
  /// Connected cells that are raised.
  struct Foot {
    float highest = 0;
    double area_px = 0;
    uint32_t before = 0;    ///< the contact of the last frame that it shares most with, or 0
    double shared_px = 0;   ///< with that
    bool was_seen = false;  ///< there was an onset at its place already
    float strongest = 0;    ///< structure
    bool at_border = false;
    uint32_t contact = 0;
  };
  /// Connected cells within an outline.
  struct Part {
    uint32_t owner = 0;
    double area_px = 0;
    float strongest = 0;  ///< structure
    uint32_t piece = 0;
    uint32_t left = UINT32_MAX, top = UINT32_MAX, right = 0, bottom = 0;  ///< first and last cells

    void add(uint32_t x, uint32_t y) {
      left = std::min(left, x), right = std::max(right, x);
      top = std::min(top, y), bottom = std::max(bottom, y);
    }
    bool surrounds(const Part& other) const {
      return left <= other.left && top <= other.top && right >= other.right && bottom >= other.bottom;
    }
  };
  /// Pieces that contacts may fall into: the piece of each cell, in this frame and the last, and each piece's
  /// contact.
  struct Pieces {
    std::vector<uint32_t> of_cell, before, owner;
  };
  void confirm(const Pieces& pieces);
  void estimate_light(std::span<const shared::CellChange> cells);
  void compare(std::span<const shared::CellChange> cells);
  void find_unsteady(const Frame& background);
  void smooth();
  void fill_rings();
  void blur(std::vector<float>& values, uint32_t radius);
  void blur_rows(const std::vector<float>& values, uint32_t radius);
  void blur_columns(std::vector<float>& values, uint32_t radius);
  Foot foot_of_edge();
  bool counts(const Foot& foot, uint32_t index) const;
  float outline_level(uint32_t contact);
  void learn();
  void mark_foot();
  void fill_holes();
  void find_rest();
  void collect(std::vector<ContactTouch>& found);
  /// Labels all cells that `from` reaches over cells that are `in`; edge_ then holds them.
  template <typename In>
  void flood(uint32_t from, uint32_t label, const In& in) {
    edge_.clear();
    edge_.push_back(from);
    label_[from] = label;
    for (size_t next = 0; next < edge_.size(); ++next) {
      const uint32_t x = edge_[next] % cells_x_, y = edge_[next] / cells_x_;
      const auto visit = [&](uint32_t u, uint32_t v) {
        const uint32_t cell = v * cells_x_ + u;
        if (!in(cell) || label_[cell] != 0) return;
        label_[cell] = label;
        edge_.push_back(cell);
      };
      if (x > 0) visit(x - 1, y);
      if (x + 1 < cells_x_) visit(x + 1, y);
      if (y > 0) visit(x, y - 1);
      if (y + 1 < cells_y_) visit(x, y + 1);
    }
  }
  uint32_t number_contacts();
  void mark_outlines();
  bool split_by_structure();
  bool join_what_one_makes();
  void find_parts();
  bool is_band(const Part& part) const;
  bool is_object(const Part& part, const Part& other) const;
  void add_parts();
  void find_far_parts(uint32_t contact, uint32_t first);
  float level_of_sorted();
  void spread_pieces();
  float contact_level(uint32_t contact, std::span<const float> depth_mm, double noise_mm) const;
  double rest_noise_mm(std::span<const float> depth_mm) const;
  void set_shapes(std::vector<ContactTouch>& found);
  void spread(const std::vector<uint8_t>& from, std::vector<uint8_t>& rows, std::vector<uint8_t>& to,
              uint32_t reach) const;
  void add_cell(uint32_t cell, ContactMoments& moments, PixelRect& box) const;
  void add_gray(std::span<const ContactTouch> gray, std::vector<ContactTouch>& found);

  FrameFormat format_;
  ShapeScale scale_;
  uint32_t cells_x_, cells_y_;
  LightEstimate estimate_;
  std::array<uint32_t, 3> radii_{};  // of three running means that are near a Gaussian
  uint32_t even_radius_ = 1, fine_radius_ = 1, margin_ = 1;  // cells
  double least_px_;
  uint32_t apart_ = 0;  // cells; 0 where a sensor has no scale
  double far_px_ = 0;
  std::array<std::vector<float>, 3> rest_gray_;  // means of the untouched image
  std::vector<float> sample_, sample_rest_;      // change and untouched image of some cells
  size_t sample_step_ = 1;
  std::vector<float> pixels_;            // of each cell
  std::vector<float> unsteady_;          // variance that moves along, gray levels squared
  std::vector<float> noise_;             // mean square, gray levels
  std::vector<float> change_;            // of the frame: mean square, gray levels
  std::vector<float> strength_, even_;   // variance of the change about a place; its mean there
  std::vector<float> raised_, scratch_;  // over noise, capped, smoothed
  std::vector<uint8_t> foot_, at_rest_, near_;
  std::vector<uint32_t> label_, owner_;  // of each cell: of a flood; of a contact, from 1
  std::vector<uint8_t> before_;          // of each cell: the last frame's contact
  std::vector<Foot> feet_;
  std::vector<uint32_t> heir_;  // of each contact of the last frame: foot, from 1
  std::vector<double> shared_px_;
  std::array<std::vector<float>, 3> means_;
  std::vector<float> sorted_;
  std::vector<uint32_t> edge_;  // what a flood has reached
  std::vector<float> edges_;    // of each contact: smoothed change at its outline
  std::vector<ContactMoments> moments_;
  std::vector<ContactTouch> outlines_;
  DepthBasins basins_;
  bool patterned_ = false;                          // a pattern printed on the whole skin
  std::vector<uint32_t> lineage_, lineage_before_;  // of each contact that find() saw, from 1
  std::vector<uint32_t> foot_of_;                   // of each contact: the one that find() saw
  Pieces by_depth_, by_structure_;
  std::vector<Part> parts_, outline_of_;                       // the latter of each contact: its sides only
  std::vector<uint32_t> number_of_;                            // of each piece: the contact that it becomes
  std::vector<uint32_t> seen_piece_, confirmed_, lineage_of_;  // of each contact before
  uint32_t last_lineage_ = 0;
  uint32_t count_ = 0;
  std::array<LightChange, 3> light_{};
  bool light_known_ = true, light_trusted_ = true;
  LightTrust trust_;
  uint64_t frames_ = 0;
  ContactTouch whole_;
};

}  // namespace palpate

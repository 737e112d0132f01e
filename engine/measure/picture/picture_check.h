// Whether a frame is the picture that the camera saw, or was spoilt on its way: part of it one colour, rolled
// around, torn, or with its colours exchanged.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "engine/measure/picture/pad_places.h"
#include "palpate/frame.h"
#include "palpate/touch.h"

namespace palpate {

/// Means along a row or a column of places, of a frame and of the untouched image.
struct PictureLine {
  const float* frame = nullptr;
  const float* untouched = nullptr;
  size_t channel_step = 0;  ///< from a channel to the next
  size_t step = 0;          ///< from a value to the next
  size_t length = 0;
  size_t from = 0, to = 0;  ///< values of the pad; those around it are where a picture that moved comes from
};

/// Looks for what no touch and no light can do, by comparison with the untouched image:
/// - OneColour: blocks of exactly one colour, where the untouched image has structure, or most of the frame,
/// and
///   another colour. Black of a dark image and saturated pixels do not count.
/// - ColourOrder: most places have the untouched image's colours in another order, or all together follow
///   another order than their own.
/// - Moved: rows, or columns, are the untouched image's, rolled around, so that the part beyond one border
///   comes in at the other; or the picture is there twice, side by side, where the untouched image is not.
/// - Torn: along a part of a row everything changes from one row to the next, and not in the rows beside it.
///
/// Only the pad is looked at, where its outline is known: what is around it may stay or change as it likes.
/// Runs on the host. Frames in order; what it finds depends on the frame and the untouched image alone.
class PictureCheck {
 public:
  /// `saturation_gray` and `pad`: of the sensor.
  PictureCheck(const FrameFormat& format, uint32_t saturation_gray,
               const std::optional<PadOutline>& pad = std::nullopt);

  void set_reference(const Frame& untouched);
  PictureFault look_at(const Frame& frame);
  /// Whether the frame of the last `look_at` equals the one before it in every pixel.
  bool repeats() const { return repeats_; }

 private:
  /// Sums along each row over parts of kPart pixels, and down bands of rows for each column.
  struct Sums {
    std::vector<float> parts;    ///< mean; channel, row, part
    std::vector<float> columns;  ///< mean; channel, band, column
  };
  void sum(const Frame& frame, Sums& sums);
  template <typename Pixel>
  void add(const Frame& frame, Sums& sums);
  void note_repeats(const Frame& frame);
  bool has_one_colour(const Frame& frame) const;
  bool is_flat_block(const Frame& frame, uint32_t x, uint32_t y, std::array<uint32_t, 3>& colour) const;
  bool is_foreign(const std::array<uint32_t, 3>& colour, uint32_t i, uint32_t y) const;
  bool colours_exchanged();
  bool moved();
  bool line_moved(const PictureLine& line);
  bool changed_evenly(const PictureLine& line) const;
  bool line_doubled(const PictureLine& line, std::optional<double>& of_untouched);
  size_t likely_shift(const PictureLine& line, double still);
  void lay_out(const PictureLine& line, uint32_t c, size_t step);
  void differences_of(const PictureLine& line, size_t shift, size_t from, size_t to);
  double quantile(double share);
  bool most_are_below(double gray) const;
  double misfit_of(const PictureLine& line, size_t shift, size_t from, size_t to, double share);
  bool torn();
  bool torn_at(uint32_t y, float least, uint32_t long_enough) const;

  static constexpr uint32_t kPart = 16;  // px
  static constexpr uint32_t kRows = 8;   // of a place whose colour is looked at
  static_assert(kPart == 2 * kRows);

  FrameFormat format_;
  uint32_t saturation_gray_;
  uint32_t parts_, bands_, band_rows_;
  PadPlaces places_;
  uint32_t widest_ = 0;  ///< blocks of the pad, of kPart x kPart px, in a row of them
  Sums untouched_, now_;
  Frame reference_;
  uint64_t last_hash_ = 0;
  bool any_ = false, repeats_ = false;
  std::vector<uint32_t> column_;
  std::vector<float> pad_;       ///< row, part: 1 where it and the part above it are pad
  std::vector<uint8_t> of_pad_;  ///< place of kRows rows, part: all its pixels are pad
  std::vector<std::optional<double>>
      unlike_;  ///< of each band: both halves of the untouched image, once known
  std::vector<float> scratch_, steps_, change_, largest_, laid_out_;
};

}  // namespace palpate

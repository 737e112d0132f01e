// Specks and flaws of a gel: pixels that are saturated in the untouched image, or where it no longer holds
// (PadFlaws), are filled from around in every frame before anything is measured.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "palpate/frame.h"

namespace palpate {

/// A speck's pixel is at `dead_gray` or above in any channel of the untouched image, or beside such a one,
/// which optics and demosaicing spoil. It, and a flaw's pixel, takes the values of the nearest pixels that
/// are none, at most kReach_px, of flaws a twentieth of the picture, to the left, right, above and below,
/// weighted by the inverse distance. Deeper in larger patches it keeps its value.
///
/// Runs on the host; frames pass as they are where there are no specks.
class Specks {
 public:
  static constexpr uint32_t kReach_px = 8;

  /// Frames of 8 bits. Without `dead_gray` nothing is a speck.
  Specks(const FrameFormat& format, std::optional<uint32_t> dead_gray);

  /// PadFlaws::flaws(); the background has to be set again.
  void set_flaws(const std::vector<uint8_t>& flaws) { flaws_ = flaws; }

  /// Finds specks; returns `background` with them filled, which lives as long as this.
  const Frame& set_background(const Frame& background);
  /// `frame` with them filled: itself without any, else a copy that lives until the next call.
  const Frame& fill(const Frame& frame);
  /// Confidence of each pixel (shaders/shared/confidence.h), height x width; null without specks.
  const std::shared_ptr<const std::vector<uint16_t>>& confidence() const { return confidence_; }

 private:
  struct Speck {
    uint32_t pixel;
    uint32_t from[4];  // pixels
    float weight[4];
  };
  void find(const Frame& background);
  void fill_into(const Frame& frame, Frame& filled) const;

  FrameFormat format_;
  std::optional<uint32_t> dead_gray_;
  std::vector<uint8_t> flaws_;
  std::vector<Speck> specks_;
  std::shared_ptr<const std::vector<uint16_t>> confidence_;
  Frame background_, filled_;
};

}  // namespace palpate

// Error of a colour gel's depth, by the presses that its calibration left out, and what calibration never
// saw.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "palpate/frame.h"
#include "palpate/sensor.h"
#include "shaders/shared/cell_change.h"

namespace palpate {

/// Slopes read from colour are wrong by the same over a whole contact, not from pixel to pixel: by weights
/// that do not quite fit the place. A depth is therefore wrong by a share of itself, which the presses left
/// out show: near a place those near it, weighted by a Gaussian of kReach, with the weight of one press for
/// all of them together. The mean square of their errors becomes the variance of the next press by Student's
/// distribution, so that few presses state a wider error.
class DepthError {
 public:
  static constexpr double kReach = 0.25;  ///< halves of the frame's width
  static constexpr double kSeen = 0.18;   ///< from a contact's rim that was pressed, likewise
  static constexpr size_t kFewest = 4;   ///< presses that state an error: the variance of fewer is not finite
  static constexpr double kMuch = 0.25;  ///< of the dented pixels, from which a depth counts as extrapolated

  DepthError(const PhotometricCalibration& calibration, const FrameFormat& format);

  /// The sensor file states an error.
  static bool states_error(const Sensor& sensor);
  /// It says what calibration saw.
  static bool states_seen(const Sensor& sensor);
  uint32_t cells_x() const { return cells_x_; }
  uint32_t cells_y() const { return static_cast<uint32_t>(saw_cell_.size() / cells_x_); }
  /// Standard error of a depth over that depth; 0: not stated.
  double relative(double x_px, double y_px) const;
  /// Presses reached as far: within kSeen of a contact, or between contacts.
  bool saw_place(double x_px, double y_px) const;
  /// Part of the picture whose places calibration saw: a share of it, inside this rectangle.
  struct SeenPart {
    double share = 0;
    PixelRect around;
  };
  SeenPart seen_part() const;
  /// Some pixel of a press had this change of red, green and blue (units of full scale), or one that
  /// lies no further from it than a bin is wide.
  bool saw_colour(const std::array<double, 3>& change) const;

  /// Marks the dented cells, deeper than `dented_mm`, whose place or mean colour calibration never saw (cells
  /// row by row).
  struct Extrapolated {
    uint64_t px = 0, dented_px = 0;
    double share() const {
      return dented_px > 0 ? static_cast<double>(px) / static_cast<double>(dented_px) : 0;
    }
  };
  Extrapolated mark(std::span<const shared::CellChange> changes, std::span<const float> depth_mm,
                    double dented_mm, std::span<uint8_t> marks) const;

 private:
  struct Place {
    double x, y;
  };
  Place place_of(double x_px, double y_px) const;

  FrameFormat format_;
  std::vector<PressError> presses_;
  std::vector<Place> places_;  ///< their middles, halves of the frame's width
  std::optional<SeenColours> colours_;
  double mean_square_ = 0, few_ = 1;  ///< error of all presses; widening of the variance, as they are few
  uint32_t cells_x_ = 0;
  std::vector<uint8_t> saw_cell_;  ///< the place of each
};

}  // namespace palpate

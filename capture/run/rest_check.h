// Check of an untouched image against the frames measured with it: whether it shows a touch itself.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "palpate/frame.h"
#include "palpate/sensor.h"

namespace palpate {

/// A touch in the untouched image leaves its negative in every frame without that touch. Such a place changes
/// against the signal or, where touch may change the image either way, has less structure in the frame than
/// in the untouched image: a pressed gel has edges, an untouched one is even. Cells of 8 x 8 px, light that
/// changed as a whole taken out.
class RestCheck {
 public:
  RestCheck(const Frame& background, const Sensor& sensor);
  /// Looks at the first kAll frames and then at every kEvery-th.
  void add(const Frame& frame);
  /// One line that says where the untouched image shows a touch, and in how many frames that is missing; or,
  /// where frames change against the signal and hardly any by it, that the signal may have the wrong
  /// sign; or, where light is not followed, that frames are under another one; empty: none of these.
  std::string warning() const;
  /// Cells times frames in which the untouched image shows what is missing, over all cells and frames looked
  /// at: 0 where it shows no touch.
  double evidence() const;

  static constexpr uint64_t kAll = 64, kEvery = 8;

 private:
  struct Cells {
    std::vector<std::vector<float>> means;      ///< of each channel, gray levels
    std::vector<std::vector<float>> structure;  ///< the same less the mean of what surrounds a cell
  };
  Cells cells_of(const Frame& frame) const;
  /// Marks cells that differ, and their difference of all channels together, signed.
  void compare(const Cells& now);
  /// Adds the connected cells from `from` on to seen_ where the touch in them is the untouched image's.
  bool judge(uint32_t from, const Cells& now);
  /// Counts the frame whose cells change by the signal, or hardly so and against it.
  void weigh();
  /// Counts the frame under another light: all of it changes by the signal, or half of it against it.
  void weigh_light(const Cells& now);

  FrameFormat format_;
  Signal signal_;
  uint32_t cells_x_, cells_y_;
  Cells rest_;
  std::vector<float> difference_, sorted_;
  std::vector<uint8_t> differs_;
  std::vector<uint32_t> region_, seen_;  ///< seen_: frames in which a cell lacks what rest_ shows
  double pressed_ = 0;                   ///< largest difference of the frame by the signal
  uint64_t frames_ = 0, looked_ = 0, missing_ = 0;
  uint64_t by_signal_ = 0, against_ = 0;  ///< frames that change so
  std::vector<float> light_;              ///< relative change of each frame under another light
};

}  // namespace palpate

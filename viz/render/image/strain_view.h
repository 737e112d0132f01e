// Strain of the pad's skin over the raw image, from the followed places of its pattern.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "engine/gpu/buffer.h"
#include "engine/gpu/commands.h"
#include "engine/measure/strain.h"
#include "palpate/frame.h"
#include "palpate/touch.h"
#include "viz/render/image/plate_map.h"

namespace palpate::viz {

/// Quantity shown by the colours over the raw image, in the plane of the skin.
enum class SkinStrain : int {
  Off,
  Stretch,  ///< the larger principal strain
  Shear,    ///< half the difference of both
};
inline constexpr int kSkinStrains = 3;
const char* to_string(SkinStrain shown);

/// One picture's map: rows of `pitch` floats, NaN where no followed place is near.
struct StrainTexels {
  const gpu::TexelView* texels = nullptr;  ///< null: there is none
  uint32_t pitch = 0;
  double largest = 0;  ///< 99 % of the map are below it
  double sd = 0;  ///< standard error in the contact's middle (the frame's without a contact); NaN: not known
  std::string missing;  ///< why there is none
};

class StrainMap {
 public:
  static constexpr size_t kFewest = 10;  ///< places; fewer show nothing
  static constexpr size_t kMost =
      600;  ///< more are thinned evenly: the frame rate is worth more than they are

  /// `frames_in_flight`: maps kept, one for each picture that may be drawing.
  StrainMap(gpu::Context& context, uint32_t frames_in_flight);

  /// A spline through the places' shifts since the untouched image, as stiff as they ask for themselves, and
  /// its strain over the frame; waits for the device. While the same places are followed the spline is
  /// factored once.
  const StrainTexels& update(const Touch& touch, const FrameFormat& format, SkinStrain shown);
  const StrainTexels& last() const { return last_; }

 private:
  struct Map {
    std::unique_ptr<PlateMap> map;
    gpu::TexelView texels;
    uint32_t width = 0, height = 0;
    SkinStrain shown = SkinStrain::Off;
  };
  Map& next_map(const FrameFormat& format, SkinStrain shown);

  gpu::Context& context_;
  gpu::Commands commands_;
  std::vector<Map> maps_;
  size_t next_ = 0;
  std::vector<std::array<double, 2>> places_;
  std::optional<StrainField> field_;
  StrainTexels last_;
};

}  // namespace palpate::viz

// Change of the light between two images: the camera's exposure, gain and white balance, or the lamps.
#pragma once

#include <span>
#include <vector>

namespace palpate {

/// Change of one colour: image = gain * untouched + offset where nothing touches.
struct LightChange {
  double gain = 1;
  double offset_gray = 0;
  bool known = true;  ///< false: too little of the picture follows one line
  double share = 1;   ///< of the picture that does

  /// The change of an untouched gray level.
  double at(double untouched_gray) const { return (gain - 1) * untouched_gray + offset_gray; }
};

/// Whether enough of a picture is as in the untouched image, but for one light. A touch may cover all but
/// LightEstimate::kFewInliers of it, once some picture has shown that the untouched image is this pad's;
/// until then kSureInliers have to agree, which those of another pad hardly do.
class LightTrust {
 public:
  static constexpr double kSureInliers = 0.5;

  /// Pictures in order; `share`: that follows one light, of the colour in which least does.
  bool enough(double share);
  void restart() { matched_ = false; }

 private:
  bool matched_ = false;
};

/// A robust line through the gray levels of an image over those of the untouched image. Start values are a
/// pure offset and a pure gain, the one with more inliers; then least squares through the inliers, repeated.
/// Touched places are outliers.
class LightEstimate {
 public:
  static constexpr double kInlier_gray = 2.5;  ///< of a place's mean from the line
  static constexpr double kFewInliers = 0.2;   ///< of all places: below, the light is not known

  /// For so many places.
  explicit LightEstimate(size_t places) { sorted_.reserve(places); }

  /// `change`: image less untouched, `untouched`: both means of places of some 16 px, gray levels.
  LightChange find(std::span<const float> change, std::span<const float> untouched);

 private:
  std::vector<float> sorted_;
};

}  // namespace palpate

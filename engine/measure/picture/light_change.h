// Change of the light between two images: the camera's exposure, gain and white balance, or the lamps.
#pragma once

#include <limits>
#include <span>
#include <vector>

namespace palpate {

/// Change of one colour: image = gain * untouched + offset where nothing touches.
struct LightChange {
  double gain = 1;
  double offset_gray = 0;
  bool known = true;        ///< false: too little of the picture follows one line
  double share = 1;         ///< of the picture that does
  double scatter_gray = 0;  ///< of the picture about the line: by its median, as a standard deviation

  /// The change of an untouched gray level.
  double at(double untouched_gray) const { return (gain - 1) * untouched_gray + offset_gray; }
  /// By how much a touch may have pulled the line off: it bends a pad far around it, to one side more than to
  /// the other. Infinite where the light is not known.
  double variance() const;
};

/// What other pictures say of one colour's light. A picture that a wide touch has pulled off follows it; one
/// that differs by more than both let expect is under another light.
struct ExpectedLight {
  LightChange light;
  double variance = std::numeric_limits<double>::infinity();  ///< gray^2; infinite: nothing is expected

  /// The most likely light of a picture by itself and by the others; `gray`: where they are compared.
  LightChange with(const LightChange& own, double gray) const;
};

/// One colour's light in a series of pictures under one lamp, in any order: their mean, weighed by how little
/// each is touched, and how much they differ by more than touches explain.
class LightSeries {
 public:
  static constexpr size_t kFewest = 3;  ///< pictures; fewer let nothing be expected

  void add(const LightChange& own) { lights_.push_back(own); }
  /// `gray`: where they are compared.
  ExpectedLight expected(double gray) const;

 private:
  std::vector<LightChange> lights_;
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
  /// Of an image in which a wide touch lies on brighter or darker places, a gain that it could feign is none.
  enum class Gain { AsSeen, BeyondTouch };
  static constexpr double kInlier_gray = 2.5;  ///< of a place's mean from the line
  static constexpr double kFewInliers = 0.2;   ///< of all places: below, the light is not known

  /// For so many places.
  explicit LightEstimate(size_t places) { sorted_.reserve(places); }

  /// `change`: image less untouched, `untouched`: both means of places of some 16 px, gray levels.
  LightChange find(std::span<const float> change, std::span<const float> untouched, Gain gain = Gain::AsSeen);

 private:
  std::vector<float> sorted_;
};

}  // namespace palpate

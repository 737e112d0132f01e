// The simulated object: a shape, a height map or a mesh that is pressed into a colour gel and moved along a
// path of six degrees of freedom, with the camera, lights and noise of the built-in sensor.
//
// The gel's surface is the object's within the contact and the untouched one beside it, smoothed as the skin
// does. Where it creeps, a share of the depth follows late, as a linear solid's. The skin under the contact
// goes along with the object (its motion at the contact's deepest place) up to what friction holds: on a half
// space of incompressible rubber that is friction times depth, whatever the size; then it slips. Frame k
// depends on the options and k alone.
#pragma once

#include <memory>
#include <string>

#include "capture/source.h"
#include "capture/synthetic/object_options.h"

namespace palpate {

/// The sensor that fits: that of the built-in gel.
Sensor object_sensor(const ObjectOptions& options);

class ObjectSensor : public Source {
 public:
  /// Throws Error(Failure::Input) where the file or the path is wrong.
  explicit ObjectSensor(const ObjectOptions& options);
  ~ObjectSensor() override;

  FrameFormat format() const override;
  double rate_Hz() const override;
  std::optional<uint64_t> frame_count() const override;
  bool next(Frame& frame) override;
  std::optional<Frame> own_background() const override;
  bool seek(uint64_t index) override;
  /// The contact's centre is that of its area, its radius that of a circle of its area. Forces are Hertz's
  /// and Mindlin's for that radius and the largest depth, of a half space: an estimate, not a solution.
  std::optional<Truth> truth(uint64_t sequence) const override;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
  uint64_t next_sequence_ = 0;
};

}  // namespace palpate

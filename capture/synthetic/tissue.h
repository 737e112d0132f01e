// The built-in palpation sensor: its window lies flush in a rigid plate, as wide as a block of tissue with a
// lump, that presses the block in steps and lifts, or goes from place to place in a hand.
// "synthetic:tissue?...".
//
// Pressure: the forward model at large strain, solved once at rising forces; between them pressure over force
// is straight in force. Optics: those of the built-in sensor (stray light, falloff, noise, clipping), with a
// pad whose light is in proportion to pressure and bright enough for tissue: a block without a lump at its
// highest force fills a quarter of 8 bits. Frame k depends on the options and k alone.
//
// A hand (hand=13) presses the places of hand_aims() in turn, each with another force, turn and tilt, and
// trembles. Where the skin has texture it touches the pad at its ridges: pressure varies around what the
// forward model says by a share that does not depend on the load, as rough surfaces do whose area of contact
// grows with it.
#pragma once

#include <memory>

#include "capture/source.h"
#include "capture/synthetic/tissue_options.h"

namespace palpate {

/// One line of what happens.
inline constexpr const char* kTissueScene = "a window in a plate presses a block of tissue with a lump in it";

/// The sensor that fits: pitch, gray per pressure, force per gray sum (of what presses on the window).
Sensor tissue_sensor(const TissueOptions& options);
/// Gray per MPa, for 8 bits.
double tissue_gray_per_MPa(const TissueOptions& options);

class TissueSensor : public Source {
 public:
  /// Solves the block (some seconds; once for all presses on the same one). Throws Error(Failure::Input) on
  /// options out of range and where the press does not get to its force.
  explicit TissueSensor(const TissueOptions& options);
  ~TissueSensor() override;

  FrameFormat format() const override;
  double rate_Hz() const override;
  std::optional<uint64_t> frame_count() const override;
  bool next(Frame& frame) override;
  std::optional<Frame> own_background() const override;
  bool seek(uint64_t index) override;
  /// Contact and force (of what presses on the window); the window is pressed all over.
  std::optional<Truth> truth(uint64_t sequence) const override;

  /// On the whole block at a frame, as a gauge behind the plate reads it.
  double block_force_N(uint64_t sequence) const;
  /// At a place of the window, mm from its middle, at that frame.
  double pressure_Pa(uint64_t sequence, double x_mm, double y_mm) const;
  /// Where a hand holds the pad at that frame.
  HeldPose held(uint64_t sequence) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
  uint64_t next_sequence_ = 0;
};

}  // namespace palpate

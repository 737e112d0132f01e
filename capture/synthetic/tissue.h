// The built-in palpation sensor: its window lies flush in a rigid plate, as wide as a block of tissue with a
// lump, that presses the block in steps and lifts. "synthetic:tissue?...".
//
// Pressure: the forward model at large strain, solved once at rising forces; between them pressure over force
// is straight in force. Optics: those of the built-in sensor (stray light, falloff, noise, clipping), with a
// pad whose light is in proportion to pressure and bright enough for tissue: a block without a lump at its
// highest force fills a quarter of 8 bits. Frame k depends on the options and k alone.
#pragma once

#include <array>
#include <memory>
#include <string>
#include <vector>

#include "capture/source.h"
#include "engine/fem/scene.h"

namespace palpate {

struct TissueOptions {
  uint32_t width = 640, height = 480;  ///< px, at least 32; the field of view is always 27.84 mm wide
  uint64_t seed = 1;                   ///< of the noise
  double rate_Hz = 30;
  bool noise = true;
  double falloff =
      0.015;            ///< fraction of the light lost in the corners, as a flat field correction leaves it
  uint32_t repeat = 1;  ///< 0: without end

  double force_N = 2;         ///< highest, on the whole block
  uint32_t loads = 4;         ///< even steps up to it, each held, 1 to 8
  double x_mm = 0, y_mm = 0;  ///< of the window's middle from the block's
  /// The block and its lump; press, presser and pad are not used. 40 x 40 x 20 cells, extrapolated with half
  /// as many along each side: one grid of so few makes lumps look soft.
  fem::Scene scene;

  TissueOptions() { scene.cells = {40, 40, 20}; }
};

/// One line of what happens.
inline constexpr const char* kTissueScene = "a window in a plate presses a block of tissue with a lump in it";

/// Whether an input is a synthetic block: "synthetic:tissue", alone or followed by "?...".
bool is_tissue(const std::string& input);
/// Keys: size, seed, rate, noise, falloff, repeat, force, loads, x, y (of the window), lump (a shape, or
/// none), d (diameter), h (depth), ratio, lx, ly (of the lump), thickness, young, cells (along the block's
/// length: a multiple of 8). Throws Error(Failure::Input) that lists them.
TissueOptions parse_tissue(const std::string& input);
/// The inverse, with every key.
std::string to_string(const TissueOptions& options);

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

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
  uint64_t next_sequence_ = 0;
};

}  // namespace palpate

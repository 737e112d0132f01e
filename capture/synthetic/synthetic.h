// The built-in sensor: a scripted indenter on an elastic pad, seen by a camera with its faults, together with
// the ground truth.
//
// Mechanics: frictionless contact with a bonded incompressible layer (engine/elasticity/layer.h).
// Tangentially the contact sticks as a spring, F_t = K u, up to Coulomb's |F_t| = mu F_z, then slips; the
// contact's centre travels with the indenter. The skin's own displacement along the surface has the core's
// size F_t / K and Cattaneo's shape (capture/synthetic/skin.h): with Q < mu P the part within c = a (1 - Q /
// (mu P))^(1/3) sticks. It depends on the present load alone, not on how that was reached. Contacts of
// several indenters are solved apart and added. Optics: gray = stray light + field(x, y) response(p); shot
// and read noise in electrons; clipping at full scale. Frame k depends on the options and k alone, so that
// any frame can be made by itself, on any thread, bit for bit.
#pragma once

#include <array>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "capture/source.h"
#include "capture/synthetic/options.h"
#include "engine/elasticity/layer.h"

namespace palpate {

/// "synthetic:SCENE?size=640x480&bits=8&mode=waveguide&seed=1&rate=30&..." with any of the keys size, bits,
/// mode (waveguide, gel, lambert), response (linear, saturating), seed, rate, repeat, noise (on, off),
/// falloff, force, radius, skin (none, markers, texture), hysteresis, drift; of the scene grip side (left,
/// right), weight_N, stiffness_N_per_mm, thickness_mm, skew_ms. Throws Error(Failure::Input) that lists what
/// exists.
SyntheticOptions parse_synthetic(const std::string& input);
/// The inverse, with every key.
std::string to_string(const SyntheticOptions& options);
/// Names of the scenes, each with one line of what happens.
std::vector<std::pair<std::string, std::string>> synthetic_scenes();

/// The sensor that fits the options, with what is known of it by construction: pitch, shear stiffness and
/// friction, force per gray sum (Waveguide, Linear; good to 1 % over the field), facing gray (Lambert),
/// photometric coefficients (Gel), gray per pressure and the pad (Waveguide, where a pixel is no larger than
/// a quarter of the pad's thickness), the skin's pattern. Dark markers leave out light: force per gray sum is
/// then that of their mean, good to 5 %.
Sensor synthetic_sensor(const SyntheticOptions& options);

/// Throws Error(Failure::Input) on options out of range.
void validate(const SyntheticOptions& options);
/// Tangential stiffness of the pad: Mindlin at the contact radius of the scene's largest force, constant over
/// the scene.
double shear_stiffness_N_per_mm(const SyntheticOptions& options);
/// Gray per MPa of contact pressure at the centre of the field (Waveguide, small pressures).
double gray_per_MPa(const SyntheticOptions& options);

/// How a contact has moved the skin under it along the pad; radius 0: it has not.
struct SkinMove {
  double x_px = 0, y_px = 0;  ///< the contact's centre
  double radius_mm = 0;
  double pull_x_mm = 0, pull_y_mm = 0;  ///< of the part that sticks
  double turn_rad = 0;                  ///< from +x towards +y
  double stick_share = 1;
};

/// Truth of a grip at one moment. The gripper closes along its x; its z points up.
struct GripTruth {
  double force_N = 0;   ///< normal force on each pad
  double load_z_N = 0;  ///< on both pads: less than 0 while the object hangs
  double thickness_mm = 0;
  double opening_mm = 0;  ///< between the faces of both pads at rest
};
/// The same at many moments.
class GripScript {
 public:
  /// Options of either finger.
  explicit GripScript(const SyntheticOptions& options);
  ~GripScript();
  GripTruth at(double time_s) const;
  /// After which it begins again; infinite: it does not.
  double round_s() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

class SyntheticSensor : public Source {
 public:
  /// Throws Error(Failure::Input) on options out of range.
  explicit SyntheticSensor(const SyntheticOptions& options);
  ~SyntheticSensor() override;

  FrameFormat format() const override;
  double rate_Hz() const override;
  std::optional<uint64_t> frame_count() const override;
  bool next(Frame& frame) override;
  /// The untouched image without temporal noise, rounded.
  std::optional<Frame> own_background() const override;
  std::optional<Truth> truth(uint64_t sequence) const override;

  /// Frame `sequence`, whatever `next` delivered so far. Safe to call from any thread. False past the end.
  bool render(uint64_t sequence, Frame& frame) const;
  /// A gel's frame in which the surface has the given slopes (height x width x 2, to the right and down) in
  /// place of the scene's; empty: untouched. Mode Gel.
  void render_relief(uint64_t sequence, std::span<const float> slopes, const SkinMove& moved,
                     Frame& frame) const;
  /// Tangential displacement, px, of the skin's point that rests at a place of the untouched image.
  std::array<double, 2> skin_shift_px(uint64_t sequence, double x_px, double y_px) const;
  /// The solved contact of that frame (with several indenters the first one's); force 0 without contact.
  LayerContact contact(uint64_t sequence) const;
  /// Standard deviation of a pixel's temporal noise where its mean is `gray`, before rounding.
  double noise_sd_gray(double gray) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
  uint64_t next_sequence_ = 0;
};

}  // namespace palpate

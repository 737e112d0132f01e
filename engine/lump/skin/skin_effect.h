// What a skin makes of a press, by the finite elements, and a press without it.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "engine/fem/large_strain/press.h"
#include "engine/fem/scene.h"
#include "engine/lump/lump_case.h"
#include "engine/lump/observation/observation.h"

namespace palpate::lump {

/// A block under a skin beside the same block of one tissue, both at an observation's forces. Of a lump it
/// holds how many times as high its bump is under the skin at each load, and what is left of the bump beyond
/// that factor; of the block alone its maps and ways. Both blocks have the same cells, so that most of what
/// cells are off by is no part of the difference.
class SkinEffect {
 public:
  /// Of the block alone: two grids extrapolated to cells of no size, or the lumps' own cells, in a tenth of
  /// the time, which tell what another skin changes.
  enum class Effort : uint8_t { Full, Rough };

  /// Presses the block alone: size, modulus and forces are the observation's, its maps are not looked at.
  /// `converged()` is false where there is no equilibrium. Throws as fem::check(), for a skin above half of
  /// the block's thickness.
  SkinEffect(const Observation& observation, const fem::Skin& skin, Effort effort = Effort::Full);

  /// Presses each of these lumps instead of those before, in the block's middle; their own places count where
  /// they are seen. False where there is no equilibrium: nothing is changed.
  bool set_lumps(const std::vector<Case::Lump>& lumps);

  /// The observation as it would be without its skin, maps and ways; `share`: of the effect that is taken
  /// back.
  Observation without_skin(const Observation& observation, double share = 1) const;

  bool converged() const { return converged_; }
  double young_Pa() const { return young_Pa_; }
  /// Height of the bumps at the highest load, over that without the skin; 1 without lumps.
  double bump_factor() const;

 private:
  struct Pressed {
    std::vector<PressureMap> pressure_Pa;
    std::vector<double> press_mm;
  };
  struct Both {
    Pressed skin, bare;
  };
  struct Seen {
    Case::Lump lump;
    Both bump;  ///< maps less those of the block alone on the same cells
  };
  /// At each load: factor of the bumps, and what is left of them at the nodes of a map.
  struct Change {
    double factor = 1;
    PressureMap left_Pa;
  };
  std::optional<Both> press_both(const std::optional<Case::Lump>& lump, bool extrapolated) const;
  std::optional<Pressed> press(const std::optional<Case::Lump>& lump, double ratio, bool extrapolated,
                               double most_mm) const;
  static Pressed at_forces(const fem::LargeStrainResult& result, const std::vector<double>& force_N);
  Case::Lump allowed(Case::Lump lump) const;
  Change change_of(size_t load, const PressureMap& nodes, const std::array<double, 2>& window_mm) const;

  std::array<double, 3> block_mm_;
  double young_Pa_;
  std::vector<double> force_N_;
  fem::Skin skin_;
  bool converged_ = false;
  std::array<double, 2> most_mm_{};  ///< way of the block alone at the highest force, under the skin and bare
  Both plain_;                       ///< as good as the effort
  Both plain_coarse_;                ///< on the lumps' own cells
  std::vector<Seen> seen_;
  std::vector<double> factors_;  ///< of the bumps, one per load, over the whole block
};

/// An observation whose skin was taken off, and how.
struct SkinTakenOff {
  Observation bare;
  std::optional<SkinEffect> effect;  ///< none: see unusable
  std::vector<Case::Lump> lumps;     ///< with which it was found
  bool settled = false;              ///< lump and effect agree
  std::string unusable;              ///< why there are no numbers
};

/// Lump and skin's effect in turn, until the lump stays. `estimate`: of an observation without a skin; one
/// with Observation::press_mm and a modulus of 0 has to find the tissue.
SkinTakenOff take_off_skin(const Observation& observation,
                           const std::function<Estimate(const Observation&)>& estimate);

/// The same observation under another skin, `thickness` and `ratio` times as thick and stiff, taken off
/// roughly and with the lumps as they were found: to be compared with the same at 1 and 1. None where there
/// is no equilibrium.
std::optional<Observation> without_other_skin(const Observation& observation, const SkinTakenOff& taken,
                                              double thickness, double ratio);

}  // namespace palpate::lump

// What a skin on the tissue, or a plate that does not slide freely, makes of a press, by the finite elements,
// and a press without it.
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

/// How a block is pressed otherwise than the networks know it: they know bare tissue under a sliding plate.
struct PressConditions {
  std::optional<fem::Skin> skin;  ///< half of the block's thickness at most
  bool plate_sticks = false;      ///< with no friction then
  double plate_friction = 0;      ///< 0 to 2
};
/// As the observation's skin and plate state them.
PressConditions conditions_of(const Observation& observation);
/// "a skin of 2 mm, 3 times as stiff as the tissue below", "a plate with a friction of 0.1", or both.
std::string conditions_text(const PressConditions& conditions);

/// A block as it is pressed beside the same block bare under a sliding plate, both at an observation's
/// forces. Of a lump it holds how many times as high its bump is at each load, and what is left of the bump
/// beyond that factor; of the block alone its maps and ways. Both blocks have the same cells, so that most of
/// what cells are off by is no part of the difference.
class PressEffect {
 public:
  /// Grids extrapolated to cells of no size, finer for the block alone than for bumps; or one coarse grid
  /// for both, in a tenth of the time, which tells what other conditions change.
  enum class Effort : uint8_t { Full, Rough };

  /// Presses the block alone: size, modulus and forces are the observation's, its maps, skin and plate are
  /// not looked at. `converged()` is false where there is no equilibrium. Throws as fem::check(), for a skin
  /// above half of the block's thickness.
  PressEffect(const Observation& observation, const PressConditions& conditions,
              Effort effort = Effort::Full);

  /// Presses each of these lumps instead of those before, in the block's middle; their own places count where
  /// they are seen. `effort`: of their bumps, no better than the effect's own. False where there is no
  /// equilibrium: nothing is changed.
  bool set_lumps(const std::vector<Case::Lump>& lumps, Effort effort = Effort::Full);

  /// The observation as it would be on bare tissue under a sliding plate, maps and ways; `share`: of the
  /// effect that is taken back.
  Observation taken_off(const Observation& observation, double share = 1) const;

  bool converged() const { return converged_; }
  double young_Pa() const { return young_Pa_; }
  /// Height of the bumps at the highest load, over that on bare tissue under a sliding plate; 1 without
  /// lumps.
  double bump_factor() const;
  /// What the conditions add to the map of the block alone at a load.
  PressureMap block_change_Pa(size_t load) const;

 private:
  using Cells = std::array<uint32_t, 3>;
  struct Pressed {
    std::vector<PressureMap> pressure_Pa;
    std::vector<double> press_mm;
  };
  /// As it is pressed, and bare under a sliding plate.
  struct Both {
    Pressed there, plain;
  };
  struct Seen {
    Case::Lump lump;
    Both bump;  ///< maps and ways less those of the block alone on the same cells
  };
  /// At each load: factor of the bumps, and what is left of them at the nodes of a map.
  struct Change {
    double factor = 1;
    PressureMap left_Pa;
  };
  std::optional<Both> press_both(const std::optional<Case::Lump>& lump, const Cells& cells) const;
  std::optional<Pressed> press(const std::optional<Case::Lump>& lump, bool there, const Cells& cells) const;
  PressConditions conditions_for(bool there) const;
  static Pressed at_forces(const fem::LargeStrainResult& result, const std::vector<double>& force_N);
  Case::Lump allowed(Case::Lump lump) const;
  Change change_of(size_t load, const PressureMap& nodes, const std::array<double, 2>& window_mm) const;

  std::array<double, 3> block_mm_;
  double young_Pa_;
  std::vector<double> force_N_;
  PressConditions conditions_;
  Effort effort_;
  bool converged_ = false;
  std::array<double, 2> most_mm_{};  ///< way of the block alone at the highest force, as it is and plain
  Both alone_;                       ///< as good as the effort
  Both alone_rough_, alone_bumps_;   ///< on the bumps' own cells, rough and not
  std::vector<Seen> seen_;
  std::vector<double> factors_;  ///< of the bumps, one per load, over the whole block
};

/// An observation whose skin and plate were taken off, and how.
struct TakenOff {
  Observation plain;
  std::optional<PressEffect> effect;  ///< none: see unusable
  std::vector<Case::Lump> lumps;      ///< with which it was found
  bool settled = false;               ///< lump and effect agree
  std::string unusable;               ///< why there are no numbers
};

/// Lump and effect of an observation's skin and plate in turn, until the lump stays. `estimate`: of an
/// observation without either; one with Observation::press_mm and a modulus of 0 has to find the tissue.
TakenOff take_off_effect(const Observation& observation,
                         const std::function<Estimate(const Observation&)>& estimate);

/// The same observation as if pressed under other conditions, taken off roughly and with the lumps as they
/// were found: to be compared with the same under its own. None where there is no equilibrium.
std::optional<Observation> taken_off_roughly(const Observation& observation, const TakenOff& taken,
                                             const PressConditions& conditions);

}  // namespace palpate::lump

// Force over the way of the plate of a block of tissue, with a lump in it or none.
#pragma once

#include <array>
#include <optional>

#include "engine/lump/lump_case.h"

namespace palpate::lump {

/// How much stiffer a pressed block is than a free column of its tissue: its logarithm as sums over few
/// terms, fitted to blocks of 40 x 40 mm on a bonded floor under a plate without friction (nu 0.495), pressed
/// by finite elements. `palpate-lab evaluate stiffness` makes the fit and says how far it is off.
struct BlockStiffness {
  static constexpr int kPlainTerms = 9;  ///< of the thickness and the compression
  static constexpr int kLumpTerms = 10;  ///< of the lump in the block

  std::array<double, kPlainTerms> plain{};
  std::array<double, kLumpTerms> lump{};
  /// RMS errors of the fit on blocks that it has not seen: of a block's logarithm, and of the part that a
  /// lump adds, as a share of it.
  double plain_sd = 0, lump_sd = 0;

  /// That of the program.
  static const BlockStiffness& built_in();

  static std::array<double, kPlainTerms> plain_terms(double thickness_mm, double compression);
  static std::array<double, kLumpTerms> lump_terms(const Case::Lump& lump, double thickness_mm,
                                                   double compression);
  /// About what a lump adds to the logarithm: its share of the volume times how little it yields, after
  /// Eshelby.
  static double dilute(const Case::Lump& lump, const std::array<double, 3>& block_mm);

  /// What a lump adds to the logarithm of the force at the same way of the plate.
  double by_lump(const Case::Lump& lump, const std::array<double, 3>& block_mm, double compression) const;
  /// Force over the block's area and the tissue's modulus at a compression (way of the plate over thickness,
  /// above 0 and below 0.5).
  double load(const std::array<double, 3>& block_mm, const std::optional<Case::Lump>& lump,
              double compression) const;
};

/// Force over area and modulus of a free column that keeps its volume.
double column_load(double compression);

}  // namespace palpate::lump

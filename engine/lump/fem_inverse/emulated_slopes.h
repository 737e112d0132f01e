// How a prediction changes with the lump, the forces and the modulus, by the network's emulator: a thousand
// times quicker than by finite elements and right to a few per cent of the change.
#pragma once

#include <memory>
#include <vector>

#include "engine/lump/fem_inverse/response.h"
#include "engine/lump/network/model.h"
#include "engine/lump/network/view.h"

namespace palpate::lump {

class EmulatedSlopes {
 public:
  /// Keeps both. `model` may be null: no lump is known.
  EmulatedSlopes(std::shared_ptr<const Model> model, const ComparedNodes& nodes);

  /// Block and loads are such as the emulator was taught, and the lump is not far from those: differences
  /// between it and others nearby are worth using. Smaller lumps than it was taught change with their volume,
  /// ratios beyond its own as the bump of a small ball does.
  bool reaches(const Case::Lump& lump) const;
  /// Pressure beyond that of tissue alone, Pa, load after load, of a lump that it reaches.
  Eigen::VectorXd bump_Pa(const Case::Lump& lump) const;
  /// Fills by_unknown, by_force and by_modulus of a prediction for a lump that it reaches.
  void fill(const Case::Lump& lump, Prediction& prediction) const;
  /// Pressure of tissue alone, Pa, load after load; of a block and loads that it knows.
  Eigen::VectorXd tissue_Pa() const;
  /// Block and loads are such as the emulator was taught.
  bool knows_block() const { return knows_block_; }

 private:
  // Nodes x loads.
  Eigen::MatrixXd tissue_Pa(const std::vector<double>& loads) const;
  Eigen::MatrixXd bump_Pa(const Case::Lump& lump, const std::vector<double>& loads) const;
  /// The patch's fields at the nodes around a lump at this place, nodes x fields; zeros beyond its reach.
  Eigen::MatrixXd fields_at(const PatchView& view) const;
  PatchView view_of(const Case::Lump& lump) const;
  /// Factors of the fields at each load, Pa.
  Eigen::MatrixXd factors_Pa(const Case::Lump& lump, const PatchView& view,
                             const std::vector<double>& loads) const;

  std::shared_ptr<const Model> model_;
  const ComparedNodes& nodes_;
  std::vector<double> loads_;
  bool knows_block_ = false;
};

}  // namespace palpate::lump

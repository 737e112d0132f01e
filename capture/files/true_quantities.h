// The quantities of a simulated scene's truth, as those that are measured.
#pragma once

#include <optional>
#include <span>

#include "capture/truth.h"
#include "engine/measure/quantities.h"

namespace palpate {

/// The truth of a frame as a row of a table has it.
struct TrueFrame {
  const Truth* truth;
  /// RMS difference between the measured and the true depth map, where it was computed.
  std::optional<double> depth_rms_error_mm = {};
};

/// In the order of the columns. Where the name without "true_" is that of a measured quantity, the two are
/// compared.
std::span<const MeasuredQuantity<TrueFrame>> true_quantities();

}  // namespace palpate

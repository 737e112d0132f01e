// The part of an observation beyond a sensor's limit: the highest pressures, and so the top of a bump.
#pragma once

#include <optional>
#include <vector>

#include "engine/lump/observation/observation.h"

namespace palpate::lump {

/// Fraction of a window's nodes from which on a load's saturation is reported.
inline constexpr double kReportedSaturation = 0.01;
/// From here on a load is left out: size, depth and ratio are distinguished by the top, which is hidden.
inline constexpr double kMostSaturation = 0.03;

/// Fraction of a map's nodes without a value; 0 of an empty map.
double unseen_fraction(const PressureMap& map);

/// For each load, the fraction of the window's nodes beyond the sensor's limit. Nodes that no load sees, and
/// that the highest one does not count as saturated, are no part of the window.
std::vector<double> saturated_fractions(const Observation& observation);

/// Saturated fraction of the last map where the sensor is not known: unseen nodes that an earlier map has
/// seen, and holes with seen nodes all around. Share of what is not unseen for another reason.
double saturated_fraction(const std::vector<PressureMap>& pressure_Pa);

/// The observation without the loads whose top is hidden. `estimate` gets a reason for each of them and for
/// those that stay with kReportedSaturation and more. None where no load is left: verdict Saturated.
std::optional<Observation> without_saturated_loads(const Observation& observation, Estimate& estimate);

}  // namespace palpate::lump

// What the strip charts show, as a table to be kept.
#pragma once

#include <string>

#include "palpate/sensor.h"
#include "viz/live/history.h"

namespace palpate::viz {

/// A CSV table of the samples within `span`: columns as in measurements.csv, as measured (no zero applied),
/// with the charts' axis first and what was marked at a moment last.
std::string chart_table(const History& history, const TimeSpan& span, const Sensor& sensor);

}  // namespace palpate::viz

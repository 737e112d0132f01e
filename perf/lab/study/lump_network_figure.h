// Counterpart of the paper's Figure 18: the forward and the inverse direction, from the numbers of a network.
#pragma once

#include <string>
#include <vector>

#include "perf/lab/study/stages.h"
#include "viz/report/plot.h"

namespace palpate {

/// `made_from`: what the network was trained by, one line.
Plot network_figure(const std::vector<lump::Stage>& stages, const std::string& made_from);

}  // namespace palpate

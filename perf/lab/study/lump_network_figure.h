// Counterpart of the paper's Figure 18: the forward and the inverse direction, from the numbers of a network.
#pragma once

#include <string>
#include <vector>

#include "perf/lab/study/stages.h"

namespace palpate {

/// Script for gnuplot, after plot_head(). `made_from`: what the network was trained by, one line.
std::string network_figure(const std::vector<lump::Stage>& stages, const std::string& made_from);

}  // namespace palpate

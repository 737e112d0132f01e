// Scaling of the generation of lump data sets with threads and processes, and its extrapolation to many
// processes.
#pragma once

#include <filesystem>
#include <string>

namespace palpate::perf {

/// Measured: cases a minute of `palpate-lab dataset` on a quick sweep with 1 and 2 threads and with 1 and 2
/// processes under mpirun (left out where there is none), medians of three runs in turn; what only the first
/// process does, keeping a case and writing it to the file; and the processor time of a case of the default
/// sweep. Modelled from these: more processes, each with a core of its own.
struct LumpScaling {
  std::string csv;       ///< kind (measured or model), sweep, how, workers, cases, cases_per_min, speed-up
  std::string words;     ///< for people
  std::string png, svg;  ///< cases a minute against workers; empty where there is no gnuplot
};

/// `program`: palpate-lab. Works in a temporary folder. Throws Error(Failure::Input) where a run fails.
LumpScaling lump_scaling(const std::filesystem::path& program);

}  // namespace palpate::perf

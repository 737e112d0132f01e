// A data set of lumps made by threads and processes; after a kill it goes on where it was.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>

#include "perf/lab/dataset/processes.h"
#include "perf/lab/dataset/sample.h"

namespace palpate::lump {

struct DatasetProgress {
  uint32_t cases = 0, done = 0, not_converged = 0;
  uint32_t done_now = 0;  ///< by this run
  double wall_s = 0;      ///< of this run
};

struct DatasetJob {
  Sweep sweep;
  std::string program;         ///< name and version: files of another are not gone on with
  std::filesystem::path file;  ///< *.h5; while it is made, also *.h5.part
  uint32_t first = 0, count = 0;
  uint32_t threads = 0;        ///< of each process; 0: one per core, under mpirun 1
  bool assemble_only = false;  ///< press nothing: write what is done
  Presser presser;
  std::function<bool()> stop;  ///< in any thread
  std::function<void(const DatasetProgress&)> progress;
};

struct DatasetReport {
  DatasetProgress progress;
  bool leads = true;      ///< false: another process has the answer
  bool complete = false;  ///< the file holds all cases
  bool written = false;   ///< there is a new file
  size_t damaged = 0;     ///< records of an earlier run that were done again
  uint32_t processes = 1, threads = 1;
  double busy_s = 0;  ///< of all threads of all processes
};

/// Presses the cases that neither the file nor its journal holds, and writes the file when all are done. Only
/// the first process touches the disk; processes and threads ask for the next case when they are done with
/// one. All processes call it with the same job. Throws Error(Failure::Input) for a file or journal of
/// another sweep, Error(Failure::Usage) for a range of cases that leaves out some of the file's.
DatasetReport make_lump_dataset(const DatasetJob& job, const Processes& processes);

/// Where the cases are kept that are done.
std::filesystem::path lump_journal_of(const std::filesystem::path& file);

}  // namespace palpate::lump

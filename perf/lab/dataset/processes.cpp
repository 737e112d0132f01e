#include "perf/lab/dataset/processes.h"

#include <cstdlib>
#include <utility>

#include "engine/base/module.h"
#include "perf/lab/dataset/mpi_module.h"

namespace palpate::lump {
namespace {

/// Set by what starts MPI programs: Open MPI, MPICH and Slurm's srun.
bool started_together() {
  for (const char* name : {"OMPI_COMM_WORLD_SIZE", "PMI_RANK", "PMIX_RANK"})
    if (std::getenv(name) != nullptr) return true;
  return false;
}

/// Loads MPI at the first call.
const MpiModule& mpi() {
  static const MpiModule& functions = *reinterpret_cast<const MpiModule* (*)()>(
      module_function("palpate_mpi", "palpate_mpi_functions", "sharing work with mpirun"))();
  return functions;
}

}  // namespace

Processes::Processes() {
  if (!started_together()) return;
  const MpiModule::Place place = mpi().join();
  joined_ = true;
  rank_ = place.rank;
  size_ = place.size;
}

Processes::~Processes() {
  if (joined_) mpi().leave();
}

void Processes::send(uint32_t to, Kind kind, const std::string& bytes) const {
  mpi().send(to, static_cast<uint8_t>(kind), bytes);
}

std::optional<Processes::Message> Processes::receive() const {
  if (size_ == 1) return std::nullopt;
  std::optional<MpiModule::Message> message = mpi().receive();
  if (!message) return std::nullopt;
  return Message{message->from, static_cast<Kind>(message->kind), std::move(message->bytes)};
}

}  // namespace palpate::lump

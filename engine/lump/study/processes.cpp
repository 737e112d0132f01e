#include "engine/lump/study/processes.h"

#include <mpi.h>

#include <cstdlib>

#include "palpate/error.h"

namespace palpate {
namespace {

/// Set by what starts MPI programs: Open MPI, MPICH and Slurm's srun.
bool started_together() {
  for (const char* name : {"OMPI_COMM_WORLD_SIZE", "PMI_RANK", "PMIX_RANK"})
    if (std::getenv(name) != nullptr) return true;
  return false;
}

}  // namespace

Processes::Processes() {
  if (!started_together()) return;
  int given = MPI_THREAD_SINGLE;
  if (MPI_Init_thread(nullptr, nullptr, MPI_THREAD_FUNNELED, &given) != MPI_SUCCESS ||
      given < MPI_THREAD_FUNNELED)
    throw Error(Failure::Usage, "an mpirun that this program's MPI understands", "another one", "Open MPI's");
  joined_ = true;
  int rank = 0, size = 1;
  MPI_Comm_rank(MPI_COMM_WORLD, &rank);
  MPI_Comm_size(MPI_COMM_WORLD, &size);
  rank_ = static_cast<uint32_t>(rank);
  size_ = static_cast<uint32_t>(size);
}

Processes::~Processes() {
  if (joined_) MPI_Finalize();
}

void Processes::send(uint32_t to, Kind kind, const std::string& bytes) const {
  MPI_Send(bytes.data(), static_cast<int>(bytes.size()), MPI_BYTE, static_cast<int>(to),
           static_cast<int>(kind), MPI_COMM_WORLD);
}

std::optional<Processes::Message> Processes::receive() const {
  if (size_ == 1) return std::nullopt;
  int there = 0;
  MPI_Status status;
  MPI_Iprobe(MPI_ANY_SOURCE, MPI_ANY_TAG, MPI_COMM_WORLD, &there, &status);
  if (there == 0) return std::nullopt;
  int count = 0;
  MPI_Get_count(&status, MPI_BYTE, &count);
  Message message{static_cast<uint32_t>(status.MPI_SOURCE), static_cast<Kind>(status.MPI_TAG),
                  std::string(static_cast<size_t>(count), '\0')};
  MPI_Recv(message.bytes.data(), count, MPI_BYTE, status.MPI_SOURCE, status.MPI_TAG, MPI_COMM_WORLD,
           MPI_STATUS_IGNORE);
  return message;
}

}  // namespace palpate

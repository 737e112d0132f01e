#include <mpi.h>

#include "palpate/error.h"
#include "perf/lab/dataset/mpi_module.h"

namespace palpate::lump {
namespace {

MpiModule::Place join() {
  int given = MPI_THREAD_SINGLE;
  if (MPI_Init_thread(nullptr, nullptr, MPI_THREAD_FUNNELED, &given) != MPI_SUCCESS ||
      given < MPI_THREAD_FUNNELED)
    throw Error(Failure::Usage, "an mpirun that this program's MPI understands", "another one", "Open MPI's");
  int rank = 0, size = 1;
  MPI_Comm_rank(MPI_COMM_WORLD, &rank);
  MPI_Comm_size(MPI_COMM_WORLD, &size);
  return {static_cast<uint32_t>(rank), static_cast<uint32_t>(size)};
}

void leave() {
  MPI_Finalize();
}

void send(uint32_t to, uint8_t kind, const std::string& bytes) {
  MPI_Send(bytes.data(), static_cast<int>(bytes.size()), MPI_BYTE, static_cast<int>(to), kind,
           MPI_COMM_WORLD);
}

std::optional<MpiModule::Message> receive() {
  int there = 0;
  MPI_Status status;
  MPI_Iprobe(MPI_ANY_SOURCE, MPI_ANY_TAG, MPI_COMM_WORLD, &there, &status);
  if (there == 0) return std::nullopt;
  int count = 0;
  MPI_Get_count(&status, MPI_BYTE, &count);
  MpiModule::Message message{static_cast<uint32_t>(status.MPI_SOURCE), static_cast<uint8_t>(status.MPI_TAG),
                             std::string(static_cast<size_t>(count), '\0')};
  MPI_Recv(message.bytes.data(), count, MPI_BYTE, status.MPI_SOURCE, status.MPI_TAG, MPI_COMM_WORLD,
           MPI_STATUS_IGNORE);
  return message;
}

}  // namespace
}  // namespace palpate::lump

extern "C" __attribute__((visibility("default"))) const palpate::lump::MpiModule* palpate_mpi_functions() {
  static const palpate::lump::MpiModule functions{&palpate::lump::join, &palpate::lump::leave,
                                                  &palpate::lump::send, &palpate::lump::receive};
  return &functions;
}

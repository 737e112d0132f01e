#include "engine/lump/dataset/module.h"

#include "engine/base/module.h"

namespace palpate::lump {
namespace {

/// Loads HDF5 at the first call.
const DatasetModule& module() {
  static const DatasetModule& functions = *reinterpret_cast<const DatasetModule* (*)()>(
      module_function("palpate_datasets", "palpate_dataset_functions", "data sets of lumps (HDF5)"))();
  return functions;
}

}  // namespace

void write_lump_file(const std::filesystem::path& path, const Sweep& sweep, const std::string& program,
                     uint32_t first, uint32_t count, const std::function<Sample(uint32_t)>& sample) {
  module().write(path, sweep, program, first, count, sample);
}

Data read_lump_file(const std::filesystem::path& path) {
  return module().read(path);
}

}  // namespace palpate::lump

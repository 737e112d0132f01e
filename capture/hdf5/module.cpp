#include "capture/hdf5/module.h"

#include "engine/base/module.h"

namespace palpate {

std::unique_ptr<Hdf5Writer> write_hdf5(const std::filesystem::path& file) {
  using Make = std::unique_ptr<Hdf5Writer> (*)(const std::filesystem::path&);
  static const Make make =
      reinterpret_cast<Make (*)()>(module_function("palpate_hdf5", "palpate_hdf5_writer", "files of HDF5"))();
  return make(file);
}

}  // namespace palpate

// Boundary of the module that reads and writes data sets: all that needs HDF5.
#pragma once

#include "engine/lump/dataset/file.h"

namespace palpate::lump {

struct DatasetModule {
  decltype(&write_lump_file) write;
  decltype(&read_lump_file) read;
};

}  // namespace palpate::lump

#include "engine/lump/dataset/module.h"

extern "C" __attribute__((visibility("default"))) const palpate::lump::DatasetModule*
palpate_dataset_functions() {
  static const palpate::lump::DatasetModule functions{&palpate::lump::write_lump_file,
                                                      &palpate::lump::read_lump_file};
  return &functions;
}

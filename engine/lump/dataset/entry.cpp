#include "engine/lump/dataset/module.h"

extern "C" __attribute__((visibility("default"))) const palpate::DatasetModule* palpate_dataset_functions() {
  static const palpate::DatasetModule functions{&palpate::write_lump_file, &palpate::read_lump_file};
  return &functions;
}

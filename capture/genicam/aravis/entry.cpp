#include "capture/genicam/aravis/parts.h"

extern "C" __attribute__((visibility("default"))) const palpate::genicam::Module*
palpate_genicam_functions() {
  static const palpate::genicam::Module functions{&palpate::genicam::list_cameras,
                                                  &palpate::genicam::open_camera};
  return &functions;
}

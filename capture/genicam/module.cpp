#include "capture/genicam/module.h"

#include "engine/base/module.h"
#include "palpate/error.h"

namespace palpate::genicam {

const Module& module() {
  static const Module& functions = *reinterpret_cast<const Module* (*)()>(
      module_function("palpate_genicam", "palpate_genicam_functions", "GenICam cameras"))();
  return functions;
}

const Module* module_if_there() {
  try {
    return &module();
  } catch (const Error&) {
    return nullptr;
  }
}

}  // namespace palpate::genicam

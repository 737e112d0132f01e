// Functions of the module, see capture/genicam/module.h.
#pragma once

#include "capture/genicam/module.h"

namespace palpate::genicam {

std::vector<Identity> list_cameras(bool with_fake);
std::unique_ptr<Device> open_camera(const std::string& asked);

}  // namespace palpate::genicam

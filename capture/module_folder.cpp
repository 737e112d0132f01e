// libpalpate_capture finds the modules that are installed next to it, whichever program uses it.
#include <dlfcn.h>

#include <filesystem>

#include "engine/base/module.h"

namespace palpate {
namespace {

[[maybe_unused]] const bool kAdded = [] {
  Dl_info library{};
  if (::dladdr(&kAdded, &library) != 0)
    add_module_folder(std::filesystem::path(library.dli_fname).parent_path() / "palpate");
  return true;
}();

}  // namespace
}  // namespace palpate

#include "engine/base/module.h"

#include <dlfcn.h>

#include <filesystem>

#include "palpate/error.h"

namespace fs = std::filesystem;

namespace palpate {
namespace {

struct Opened {
  void* handle = nullptr;
  std::string reason;
};

Opened open(const std::string& file) {
  // Global: MPI's own plug-ins look for its symbols.
  void* handle = ::dlopen(file.c_str(), RTLD_NOW | RTLD_GLOBAL | RTLD_NODELETE);
  if (handle) return {handle, {}};
  const char* reason = ::dlerror();
  return {nullptr, reason ? reason : "it cannot be loaded"};
}

Opened find(const std::string& name) {
  const std::string file = name + ".so";
  std::error_code error;
  const fs::path program = fs::read_symlink("/proc/self/exe", error).parent_path();
  for (const char* folder : {"lib/palpate", PALPATE_MODULE_FOLDER})
    if (const fs::path path = program / folder / file; fs::exists(path, error)) return open(path.string());
  return open(file);
}

}  // namespace

void* module_function(const std::string& name, const char* function, const std::string& purpose) {
  const auto refuse = [&](const std::string& found) {
    throw Error(Failure::Input, "the module " + name + " for " + purpose, found,
                "installing all of palpate, or building it with this part");
  };
  const Opened module = find(name);
  if (!module.handle) refuse(module.reason);
  void* address = ::dlsym(module.handle, function);
  if (!address) refuse("one of another version");
  return address;
}

}  // namespace palpate

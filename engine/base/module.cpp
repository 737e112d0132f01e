#include "engine/base/module.h"

#include <dlfcn.h>

#include <filesystem>
#include <mutex>
#include <vector>

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

std::mutex folders_mutex;
std::vector<fs::path> folders;

Opened find(const std::string& name) {
  const std::string file = name + ".so";
  std::error_code error;
  const fs::path program = fs::read_symlink("/proc/self/exe", error).parent_path();
  for (const char* folder : {"lib/palpate", PALPATE_MODULE_FOLDER})
    if (const fs::path path = program / folder / file; fs::exists(path, error)) return open(path.string());
  const std::lock_guard lock(folders_mutex);
  for (const fs::path& folder : folders)
    if (const fs::path path = folder / file; fs::exists(path, error)) return open(path.string());
  return open(file);
}

}  // namespace

void add_module_folder(const fs::path& folder) {
  const std::lock_guard lock(folders_mutex);
  folders.push_back(folder);
}

void* module_function(const std::string& name, const char* function, const std::string& purpose) {
  const auto refuse = [&](const std::string& found) {
    throw Error(Failure::Input, "the module " + name + " for " + purpose, found,
                "installing all of palpate, or building it with this part");
  };
  const Opened module = find(name);
  if (!module.handle) refuse(module.reason);
  void* address = ::dlsym(module.handle, function);
  if (!address) refuse("a module of another version");
  return address;
}

}  // namespace palpate

// Modules: parts of palpate that need dozens of shared libraries (libav, MPI), loaded when they are
// first used.
#pragma once

#include <filesystem>
#include <string>

namespace palpate {

/// Looks for modules in `folder` too, after the places next to the program: for libraries that a program of
/// another kind has loaded.
void add_module_folder(const std::filesystem::path& folder);

/// The address of `function` in the module `name` ("palpate_video"), which stays loaded until the program
/// ends. Modules lie in lib/palpate next to the program, where the installation puts them, or on the loader's
/// own path. Throws Error(Failure::Input) that names the module, its `purpose` and the loader's reason.
void* module_function(const std::string& name, const char* function, const std::string& purpose);

}  // namespace palpate

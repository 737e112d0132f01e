// Readers and clients that others wrote (tests/clients), with their libraries.
#pragma once

#include <cstdlib>
#include <filesystem>
#include <string>

namespace palpate {

/// Their folder; empty where npm cannot get the libraries.
inline const std::filesystem::path& clients_folder() {
  namespace fs = std::filesystem;
  static const fs::path folder = [] {
    fs::path at = fs::path(PALPATE_PROGRAM).parent_path() / "clients";
    fs::create_directories(at);
    for (const auto& file : fs::directory_iterator(fs::path(PALPATE_SOURCE_DIR) / "tests/clients"))
      if (file.is_regular_file())
        fs::copy_file(file.path(), at / file.path().filename(), fs::copy_options::overwrite_existing);
    const std::string library = (at / "node_modules/@foxglove/ws-protocol").string();
    if (fs::exists(library)) return at;
    const std::string command =
        "cd '" + at.string() + "' && timeout 120 npm ci --ignore-scripts >npm.log 2>&1";
    return std::system(command.c_str()) == 0 && fs::exists(library) ? at : fs::path();
  }();
  return folder;
}

}  // namespace palpate

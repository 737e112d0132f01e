// Why a file cannot be read, in words.
#pragma once

#include <filesystem>
#include <string>

namespace palpate {

/// "no such file", "a folder", "permission denied", "an empty file (0 bytes)", or what the system says; empty
/// where the file can be opened and has content.
std::string why_unreadable(const std::filesystem::path& file);

}  // namespace palpate

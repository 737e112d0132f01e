// Why a file cannot be read, in words.
#pragma once

#include <filesystem>
#include <string>
#include <system_error>

namespace palpate {

/// A library's message as it stands within a sentence: its first letter small, unless a name begins there.
std::string within_sentence(std::string words);
/// The system's words for an error: "no such file or directory".
std::string system_words(const std::error_code& error);
std::string system_words(int code);  ///< of errno

/// "no such file", "a folder", "permission denied", "an empty file (0 bytes)", or what the system says; empty
/// where the file can be opened and has content.
std::string why_unreadable(const std::filesystem::path& file);

}  // namespace palpate

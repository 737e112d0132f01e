// Text files, whole.
#pragma once

#include <filesystem>
#include <string>

namespace palpate {

/// The bytes of `file`; "" where there is none.
std::string slurp(const std::filesystem::path& file);
void spill(const std::filesystem::path& file, const std::string& text);

inline bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

}  // namespace palpate

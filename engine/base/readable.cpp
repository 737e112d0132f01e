#include "engine/base/readable.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>

namespace palpate {

std::string within_sentence(std::string words) {
  // "RPC ..." and "I/O error" keep their capitals.
  if (words.size() > 1 && words[0] >= 'A' && words[0] <= 'Z' && words[1] >= 'a' && words[1] <= 'z')
    words[0] = static_cast<char>(words[0] - 'A' + 'a');
  return words;
}

std::string system_words(const std::error_code& error) {
  return within_sentence(error.message());
}

std::string system_words(int code) {
  return system_words(std::error_code(code, std::generic_category()));
}

std::string why_unreadable(const std::filesystem::path& file) {
  std::error_code error;
  const std::filesystem::file_status status = std::filesystem::status(file, error);
  if (status.type() == std::filesystem::file_type::not_found) return "no such file";
  if (status.type() == std::filesystem::file_type::directory) return "a folder";
  // A pipe is left alone: its writer would lose its reader.
  if (status.type() != std::filesystem::file_type::regular) return {};
  const int opened = open(file.c_str(), O_RDONLY | O_CLOEXEC);
  if (opened < 0) {
    if (errno == EACCES || errno == EPERM) return "permission denied";
    return system_words(errno);
  }
  close(opened);
  if (std::filesystem::file_size(file, error) == 0 && !error) return "an empty file (0 bytes)";
  return {};
}

}  // namespace palpate

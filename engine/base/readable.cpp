#include "engine/base/readable.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>

namespace palpate {

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
    return std::error_code(errno, std::generic_category()).message();
  }
  close(opened);
  if (std::filesystem::file_size(file, error) == 0 && !error) return "an empty file (0 bytes)";
  return {};
}

}  // namespace palpate

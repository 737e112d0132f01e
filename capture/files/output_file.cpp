#include "capture/files/output_file.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <vector>

#include "engine/base/readable.h"
#include "engine/base/text.h"
#include "palpate/error.h"

namespace palpate {
namespace {

[[noreturn]] void fail(const std::filesystem::path& path, int code) {
  const char* remedy = "another --out folder";
  if (code == ENOSPC || code == EDQUOT) remedy = "freeing disk space, or another --out folder";
  if (code == EFBIG) remedy = "a larger limit on file sizes (ulimit -f), or another --out folder";
  throw Error(Failure::Output, "to write '" + path.string() + "'", system_words(code), remedy);
}

/// Writes all or returns the error.
int write_all(int file, const void* bytes, size_t count) {
  const auto* p = static_cast<const char*>(bytes);
  while (count > 0) {
    const ssize_t done = ::write(file, p, count);
    if (done < 0) {
      if (errno == EINTR) continue;
      return errno;
    }
    p += done;
    count -= static_cast<size_t>(done);
  }
  return 0;
}

}  // namespace

void make_output_folder(const std::filesystem::path& folder) {
  std::error_code code;
  std::filesystem::create_directories(folder, code);
  if (!std::filesystem::is_directory(folder)) {
    throw Error(Failure::Output, "a folder '" + folder.string() + "' to write to",
                code ? system_words(code) : "something else of that name", "another --out folder");
  }
  // Permission bits do not restrict root, and a read-only mount sets none: only creating a file proves it.
  const std::filesystem::path probe = folder / (".palpate-" + std::to_string(::getpid()));
  const int file = ::open(probe.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
  if (file < 0) fail(folder, errno);
  ::close(file);
  ::unlink(probe.c_str());
}

void clear_numbered_files(const std::filesystem::path& folder) {
  std::error_code code;
  std::filesystem::directory_iterator entries(folder, code);
  if (code) return;
  std::vector<std::filesystem::path> old;
  for (const auto& entry : entries) {
    const std::string stem = entry.path().stem().string();
    const bool numbered = stem.size() >= 6 &&
                          std::all_of(stem.begin(), stem.end(), [](char c) { return c >= '0' && c <= '9'; });
    if (numbered && entry.is_regular_file(code)) old.push_back(entry.path());
  }
  for (const auto& path : old) {
    if (::unlink(path.c_str()) != 0) fail(path, errno);
  }
}

std::string numbered_name(uint64_t frame, std::string_view extension) {
  const std::string digits = text("%06llu.", static_cast<unsigned long long>(frame));
  return std::string(digits).append(extension);
}

OutputFile::OutputFile(const std::filesystem::path& path)
    : path_(path),
      partial_(path.parent_path() /
               ("." + path.filename().string() + "." + std::to_string(::getpid()) + ".partial")) {
  file_ = ::open(partial_.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
  if (file_ < 0) fail(path_, errno);
}

OutputFile::~OutputFile() {
  if (file_ < 0) return;
  ::close(file_);
  ::unlink(partial_.c_str());
}

void OutputFile::write(const void* bytes, size_t count) {
  if (const int code = write_all(file_, bytes, count)) fail(path_, code);
}

void OutputFile::commit() {
  const bool closed = ::close(file_) == 0;  // network disks report a full disk here and nowhere else
  file_ = -1;
  if (!closed || ::rename(partial_.c_str(), path_.c_str()) != 0) {
    const int code = errno;
    ::unlink(partial_.c_str());
    fail(path_, code);
  }
}

void OutputFile::commit_durably() {
  if (::fsync(file_) != 0 && errno != EINVAL && errno != EROFS) fail(path_, errno);
  commit();
  const std::filesystem::path folder = path_.parent_path().empty() ? "." : path_.parent_path();
  const int held = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (held < 0) return;  // a folder that cannot be read can hold the file all the same
  ::fsync(held);
  ::close(held);
}

LineFile::LineFile(const std::filesystem::path& path) : path_(path) {
  file_ = ::open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
  if (file_ < 0) fail(path_, errno);
}

LineFile::~LineFile() {
  if (file_ >= 0) ::close(file_);
}

void LineFile::append(std::string_view line) {
  const std::string whole = std::string(line) + '\n';
  append_bytes({reinterpret_cast<const uint8_t*>(whole.data()), whole.size()});
}

void LineFile::append_bytes(std::span<const uint8_t> bytes) {
  if (const int code = write_all(file_, bytes.data(), bytes.size())) {
    if (::ftruncate(file_, length_) == 0) ::lseek(file_, length_, SEEK_SET);
    fail(path_, code);
  }
  length_ += static_cast<int64_t>(bytes.size());
}

void LineFile::sync() {
  if (::fdatasync(file_) != 0 && errno != EINVAL && errno != EROFS) fail(path_, errno);
}

void LineFile::close() {
  if (file_ < 0) return;
  const bool synced = ::fsync(file_) == 0 || errno == EINVAL || errno == EROFS;
  const int sync_code = errno;
  const bool closed = ::close(file_) == 0;
  const int close_code = errno;
  file_ = -1;
  if (!synced) fail(path_, sync_code);
  if (!closed) fail(path_, close_code);
}

void write_whole(const std::filesystem::path& path, std::span<const uint8_t> bytes) {
  OutputFile file(path);
  file.write(bytes.data(), bytes.size());
  file.commit();
}

void write_whole(const std::filesystem::path& path, std::string_view text) {
  OutputFile file(path);
  file.write(text);
  file.commit();
}

}  // namespace palpate

// Output files that appear only when complete: written under a temporary name, renamed at the end.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>

namespace palpate {

/// Makes `folder` (and its parents) and proves that a file can be written there. Throws
/// Error(Failure::Output).
void make_output_folder(const std::filesystem::path& folder);

/// Removes what an earlier run left in `folder`: files named by a frame number only (000017.png). Other files
/// stay.
void clear_numbered_files(const std::filesystem::path& folder);

/// Name of a frame's file: at least six digits, so that names sort as frames do.
std::string numbered_name(uint64_t frame, std::string_view extension);

/// A file that appears under its name in one step when `commit` is called; without it nothing stays behind.
/// Every member throws Error(Failure::Output) where the system refuses (permissions, full disk, size limit).
class OutputFile {
 public:
  explicit OutputFile(const std::filesystem::path& path);
  ~OutputFile();
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  void write(const void* bytes, size_t count);
  void write(std::string_view text) { write(text.data(), text.size()); }
  void commit();
  /// The same, and the disk has it when this returns.
  void commit_durably();

 private:
  std::filesystem::path path_;
  std::filesystem::path partial_;
  int file_ = -1;
};

/// A file whose every line is whole as soon as `append` returns, so that a run that is stopped keeps what it
/// wrote. A line that cannot be written in full is taken back before the error is thrown.
class LineFile {
 public:
  explicit LineFile(const std::filesystem::path& path);
  ~LineFile();
  LineFile(const LineFile&) = delete;
  LineFile& operator=(const LineFile&) = delete;

  void append(std::string_view line);  ///< without its line end
  /// The same of bytes that are no line.
  void append_bytes(std::span<const uint8_t> bytes);
  /// Makes the disk have what was appended; from any thread, before close.
  void sync();
  /// Hands everything to the disk and closes; throws where that fails.
  void close();

 private:
  std::filesystem::path path_;
  int file_ = -1;
  int64_t length_ = 0;
};

/// Writes `bytes` to `path` in one step.
void write_whole(const std::filesystem::path& path, std::span<const uint8_t> bytes);
void write_whole(const std::filesystem::path& path, std::string_view text);

}  // namespace palpate

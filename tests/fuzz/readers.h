// Every reader of files as the program calls it, and the promise that each keeps for any bytes whatever: it
// reads the file, or refuses it with one line.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>

namespace palpate::fuzz {

/// The reader of one kind of file.
struct Reader {
  const char* name;  ///< also the folder of its files, tests/fuzz/corpus/NAME
  const char* file;  ///< name that a file gets: some readers look at its ending
  /// Reads as the program does. Throws palpate::Error as documented, std::logic_error where what was read
  /// breaks what the reader promises.
  void (*read)(const std::filesystem::path& file);
  /// Rewrites the check sums of a file whose bytes were changed, so that changes get past them; null: there
  /// are none.
  void (*mend)(std::span<uint8_t> bytes) = nullptr;
  bool may_blame_input = true, may_blame_sensor = false;  ///< the failures that it may have
};

std::span<const Reader> readers();
/// Throws std::out_of_range.
const Reader& reader(std::string_view name);

/// Writes the bytes to a file in `folder` and reads it. Empty where it was read, or refused with one line
/// that says what was wanted, what was found and what to try; else what was wrong. The file stays until the
/// next call.
std::string trouble_of(const Reader& reader, std::span<const uint8_t> bytes,
                       const std::filesystem::path& folder);

}  // namespace palpate::fuzz

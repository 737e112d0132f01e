// Valid files, damaged at random, for every reader of files: each must read or refuse with one line, and
// never crash.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

namespace palpate::fuzz {

enum class Kind { Sensor, Npy, Png, Pgm, Tiff, Bmp, Jpeg, Video };
constexpr Kind kKinds[] = {Kind::Sensor, Kind::Npy, Kind::Png,  Kind::Pgm,
                           Kind::Tiff,   Kind::Bmp, Kind::Jpeg, Kind::Video};
const char* to_string(Kind kind);

/// Writes `seed`'s damaged file to `folder` and reads it. Empty where that went as it should; else what was
/// wrong. The file stays until the next call: after a crash it is the culprit.
std::string file_trouble(Kind kind, uint64_t seed, const std::filesystem::path& folder);

}  // namespace palpate::fuzz

// Films for tests, made by libav: any codec and container, frames at any times, packets damaged or cut away.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <vector>

namespace palpate {

struct FilmSetting {
  std::string codec = {};              ///< name of libav's encoder
  std::vector<int64_t> times_ms = {};  ///< of the frames
  int time_base_per_s = 1000;
  int gop = 10;
  int b_frames = 0;
  std::string format = {};  ///< name of the muxer; empty: by the file's name
  std::string movflags = {};
  uint32_t width = 128, height = 96;
  /// Changes the bytes of packet `index`, in the order of coding.
  std::function<void(size_t index, std::span<uint8_t> bytes)> damage = {};
};

/// Gray frames that `frame_shown` tells apart.
void write_film(const std::filesystem::path& file, const FilmSetting& setting);
/// The film's packets from the key frame before `from_ms` on, as cutting without coding does it: frames
/// before `from_ms` stay in the file, and the container says that they are not shown.
void cut_film(const std::filesystem::path& from, const std::filesystem::path& to, int64_t from_ms);

/// Number of the frame whose picture this is, by its bright and dark fields. `gray_at(x, y)`: 0 to 255.
uint32_t frame_shown(uint32_t width, uint32_t height,
                     const std::function<double(uint32_t x, uint32_t y)>& gray_at);

}  // namespace palpate

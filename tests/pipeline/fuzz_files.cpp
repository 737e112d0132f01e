#include "tests/pipeline/fuzz_files.h"

#include <array>
#include <cmath>
#include <cstring>
#include <fstream>
#include <map>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/videoio.hpp>
#include <random>

#include "capture/files/images/images.h"
#include "capture/files/npy.h"
#include "capture/open_source.h"
#include "palpate/error.h"
#include "palpate/sensor.h"

namespace palpate::fuzz {
namespace {

namespace fs = std::filesystem;

const char* extension(Kind kind) {
  constexpr const char* kEnds[] = {".json", ".npy", ".png", ".pgm", ".tif", ".bmp", ".jpg", ".avi"};
  return kEnds[static_cast<int>(kind)];
}

constexpr const char* kSensor = R"({
  "palpate_sensor": 1, "name": "fuzz", "pitch_mm_per_px": 0.0435,
  "frame": {"crop_px": [0, 0, 640, 480], "quad_px": [[12, 9], [630, 11], [628, 470], [10, 468]], "size_px": [640, 480],
            "channels": 3, "bit_depth": 8},
  "background": {"image": "rest.png", "first_frames": 10},
  "contact": {"signal": "either", "threshold_gray": 4, "saturation_gray": 255},
  "surface": {"reading": "photometric", "max_slope": 10, "shading": {"facing_gray": 200, "depth_gain": 1},
    "photometric": {"wx": [[1, 0, 0], [0, 1, 0.5], [-1e-3, 0, 2]], "wy": [[0, 0, 1], [1, 0, 0], [2, 1, 0]], "normal_sd": 0.1}},
  "force": {"c1_N_per_gray": 7.57e-07, "c0_N": 0.0003, "residual_sd_N": 0.0002, "covariance": [4e-10, -4e-16, 1e-21],
            "gray_min": 0, "gray_max": 2100000},
  "shear": {"kx_N_per_mm": 0.98, "ky_N_per_mm": 0.98, "friction": 0.5, "relative_sd": 0.01}
})";

std::string slurp(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

/// Small valid files to start from, made once.
const std::vector<std::string>& originals(Kind kind, const fs::path& folder) {
  static std::map<Kind, std::vector<std::string>> made;
  std::vector<std::string>& files = made[kind];
  if (!files.empty()) return files;
  const fs::path scratch = folder / (std::string("original") + extension(kind));
  if (kind == Kind::Sensor) {
    files.emplace_back(kSensor);
  } else if (kind == Kind::Npy) {
    const std::vector<float> values(24, 1.5f);
    write_npy(scratch, values, {4, 3, 2});
    files.push_back(slurp(scratch));
  } else if (kind == Kind::Video) {
    for (const char* fourcc : {"MJPG", "FFV1"}) {
      cv::VideoWriter out(scratch.string(), cv::CAP_FFMPEG,
                          cv::VideoWriter::fourcc(fourcc[0], fourcc[1], fourcc[2], fourcc[3]), 25, {32, 24});
      for (int i = 0; i < 5; ++i) out.write(cv::Mat(24, 32, CV_8UC3, cv::Scalar(10 * i, 50, 100)));
      out.release();
      if (std::string film = slurp(scratch); !film.empty()) files.push_back(std::move(film));
    }
  } else {
    for (const int type : {CV_8UC1, CV_16UC1, CV_8UC3}) {
      if (type != CV_8UC1 && kind == Kind::Pgm) continue;
      if (type == CV_16UC1 && (kind == Kind::Bmp || kind == Kind::Jpeg)) continue;
      cv::Mat image(19, 23, type);
      cv::RNG(7).fill(image, cv::RNG::UNIFORM, 0, 200);
      std::vector<uint8_t> bytes;
      cv::imencode(extension(kind), image, bytes);
      files.emplace_back(bytes.begin(), bytes.end());
    }
  }
  fs::remove(scratch);
  return files;
}

std::string damage(std::string file, std::mt19937_64& random) {
  const auto below = [&](size_t n) { return n == 0 ? size_t{0} : static_cast<size_t>(random() % n); };
  // Headers are where the numbers are that lie best.
  const auto place = [&] {
    return random() % 2 ? below(file.size()) : below(std::min<size_t>(file.size(), 256));
  };
  const size_t changes = 1 + below(4);
  for (size_t i = 0; i < changes && !file.empty(); ++i) {
    const size_t at = place();
    const size_t length = 1 + below(std::min<size_t>(file.size() - at, 32));
    switch (below(8)) {
      case 0:
        file[at] = static_cast<char>(file[at] ^ (1 << below(8)));
        break;
      case 1:
        file[at] = static_cast<char>(random());
        break;
      case 2: {  // a number at the end of its range, of either byte order
        constexpr std::array<uint32_t, 8> kEnds = {0,      1,          0x7f,       0x7fff,
                                                   0xffff, 0x7fffffff, 0x80000000, 0xffffffff};
        uint32_t value = kEnds[below(kEnds.size())];
        if (random() % 2) value = __builtin_bswap32(value);
        std::memcpy(file.data() + at, &value, std::min<size_t>(4, file.size() - at));
        break;
      }
      case 3:
        file.resize(at);
        break;
      case 4:
        file.erase(at, length);
        break;
      case 5:
        file.insert(below(file.size()), file.substr(at, length));
        break;
      case 6:
        file.replace(at, length, length, static_cast<char>(random()));
        break;
      default: {  // what numbers in text may become
        constexpr std::array<const char*, 12> kWords = {
            "-1", "1e999", "nan",   "null", "[", "}", "\"", "0", "99999999999999999999",
            "{}", "true",  "1e-320"};
        const std::string word = kWords[below(kWords.size())];
        file.replace(at, std::min(word.size(), file.size() - at), word);
      }
    }
  }
  return file;
}

/// Reads the file as the program would. Throws Error as documented; returns what is wrong with what was read.
std::string read(Kind kind, const fs::path& file) {
  if (kind == Kind::Sensor) {
    const Sensor sensor = load_sensor(file);
    validate(sensor, "what was loaded");
    return sensor.pitch_mm_per_px > 0 && std::isfinite(sensor.pitch_mm_per_px) ? ""
                                                                               : "a pitch that is no length";
  }
  if (kind == Kind::Npy) {
    const NpyArray array = read_npy(file);
    size_t count = 1;
    for (const size_t size : array.shape) count *= size;
    return array.values.size() == count ? "" : "values that do not fill the shape";
  }
  Sensor sensor;
  sensor.name = "fuzz";
  sensor.pitch_mm_per_px = 0.1;
  const auto source = open_source(file.string(), sensor);
  Frame frame;
  int frames = 0;
  constexpr int kMost = 100;
  while (frames < kMost && source->next(frame)) {
    ++frames;
    if (frame.format != source->format() || frame.bytes.size() != frame.format.frame_bytes())
      return "a frame of another format";
  }
  return frames < kMost ? "" : "frames without end";
}

}  // namespace

const char* to_string(Kind kind) {
  constexpr const char* kNames[] = {"sensor file", "array", "PNG", "PGM", "TIFF", "BMP", "JPEG", "video"};
  return kNames[static_cast<int>(kind)];
}

std::string file_trouble(Kind kind, uint64_t seed, const fs::path& folder) {
  std::mt19937_64 random(seed * 16 + static_cast<uint64_t>(kind));
  const auto& files = originals(kind, folder);
  const fs::path file = folder / (std::string("damaged") + extension(kind));
  std::ofstream(file, std::ios::binary | std::ios::trunc) << damage(files[random() % files.size()], random);
  try {
    return read(kind, file);
  } catch (const Error& error) {
    const std::string line = error.what();
    if (error.failure() != (kind == Kind::Sensor ? Failure::Sensor : Failure::Input))
      return "another kind of failure: " + line;
    if (line.find('\n') != std::string::npos) return "more than one line: " + line;
    for (const char* word : {"wanted ", "; found ", "; try "})
      if (line.find(word) == std::string::npos) return "a line without '" + std::string(word) + "': " + line;
    return {};
  } catch (const std::exception& error) {
    return std::string("an exception that is no Error: ") + error.what();
  }
}

}  // namespace palpate::fuzz

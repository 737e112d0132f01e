#include "capture/files/light_files.h"

#include <cmath>
#include <cstring>
#include <fstream>
#include <iterator>
#include <opencv2/core.hpp>

#include "capture/files/images/images.h"
#include "capture/files/npy.h"
#include "capture/files/output_file.h"
#include "engine/sensor/json.h"
#include "palpate/error.h"

namespace palpate {
namespace {

namespace fs = std::filesystem;
using Json = json::Value;
using sensor_json::Reader;

constexpr int kLightsVersion = 1;
constexpr uint32_t kMostLights = 64;
constexpr int kHighestOrder = 3;

size_t weights_of(uint32_t lights, int order) {
  return (lights + size_t{1}) * static_cast<size_t>((order + 1) * (order + 2) / 2);
}

std::string size_text(uint32_t width, uint32_t height) {
  return std::to_string(width) + " x " + std::to_string(height) + " px";
}

/// A text line, a comment up to a 0, columns and rows, lengths and offsets in mm, heights row by row.
NpyArray read_true_map(const fs::path& file) {
  const auto refuse = [&](const std::string& found) {
    throw Error(Failure::Input, "heights as a TrueMap file of version 2 in '" + file.string() + "'", found,
                "the scanner's own .tmd file, or the heights as a NumPy array");
  };
  std::ifstream in(file, std::ios::binary);
  if (!in) refuse("no such file");
  const std::string bytes{std::istreambuf_iterator<char>(in), {}};
  constexpr std::string_view kBegin = "Binary TrueMap Data File v2.0";
  constexpr size_t kHead = 32, kNumbers = 24;
  if (!bytes.starts_with(kBegin)) refuse("another kind of file");
  const size_t zero = bytes.find('\0', kHead);
  if (zero == std::string::npos || bytes.size() < zero + 1 + kNumbers) refuse("a file cut short");
  uint32_t columns = 0, rows = 0;
  std::memcpy(&columns, bytes.data() + zero + 1, 4);
  std::memcpy(&rows, bytes.data() + zero + 5, 4);
  const uint64_t count = uint64_t{columns} * rows;
  const size_t begin = zero + 1 + kNumbers;
  if (count == 0 || count > kMaxNpyElements || (bytes.size() - begin) / sizeof(float) < count)
    refuse(std::to_string(bytes.size() - begin) + " bytes for " + size_text(columns, rows));
  NpyArray map{{rows, columns}, std::vector<float>(count)};
  std::memcpy(map.values.data(), bytes.data() + begin, count * sizeof(float));
  return map;
}

std::vector<double> read_weights(Reader& reader, const char* key, size_t count) {
  const Json& list = reader.array(key, count, "weights of (lights + 1) polynomials");
  std::vector<double> weights;
  for (const Json& weight : list)
    weights.push_back(Reader::checked(weight, reader.path(key), -sensor_json::kHuge, sensor_json::kHuge, ""));
  return weights;
}

}  // namespace

LightImages read_light_images(const std::vector<fs::path>& files) {
  constexpr size_t kLeast = 3;
  if (files.size() < kLeast || files.size() > kMostLights)
    throw Error(Failure::Input, "3 to 64 images, each under a light of its own", std::to_string(files.size()),
                "an image file for each light, in the order of the lights");
  LightImages images;
  for (const fs::path& file : files) {
    cv::Mat image = read_image(file);
    if (image.channels() != 1)
      throw Error(Failure::Input, "a gray image in '" + file.string() + "'", "a colour image",
                  "one gray image for each light");
    const auto width = static_cast<uint32_t>(image.cols), height = static_cast<uint32_t>(image.rows);
    if (images.images.empty()) {
      images.width = width;
      images.height = height;
    } else if (images.width != width || images.height != height) {
      throw Error(Failure::Input,
                  "an image of " + size_text(images.width, images.height) + " in '" + file.string() +
                      "', as the first one",
                  size_text(width, height), "images of one camera without crop");
    }
    image.convertTo(image, CV_32F);
    images.images.emplace_back(image.ptr<float>(), image.ptr<float>() + image.total());
  }
  return images;
}

std::vector<float> read_heights(const fs::path& file, const LightImages& images) {
  NpyArray map = file.extension() == ".tmd" ? read_true_map(file) : read_npy(file);
  if (map.shape != std::vector<size_t>{images.height, images.width})
    throw Error(Failure::Input,
                "heights of " + describe_shape({images.height, images.width}) +
                    " (rows x columns, as the images) in '" + file.string() + "'",
                describe_shape(map.shape), "the height map of the same scan, in mm");
  return std::move(map.values);
}

void save_light_calibration(const LightCalibration& c, const fs::path& file) {
  Json json = {{"palpate_lights", kLightsVersion},
               {"lights", c.stack.lights},
               {"order", c.stack.order},
               {"size_px", {c.width, c.height}},
               {"pitch_mm_per_px", c.pitch_mm_per_px},
               {"explained_x", c.stack.explained_x},
               {"explained_y", c.stack.explained_y},
               {"bands_rms_mm", c.bands_mm},
               {"halves_rms_mm", c.halves_mm},
               {"wx", c.stack.wx},
               {"wy", c.stack.wy}};
  Json origin = Json::object();
  sensor_json::add_origin(origin, c.origin);
  if (origin.contains("origin")) json["origin"] = origin["origin"];
  write_whole(file, std::string_view(json.dump(2, json::Utf8::Replace) + "\n"));
}

LightCalibration load_light_calibration(const fs::path& file) {
  const std::string remedy = "the file that palpate calibrate lights wrote";
  std::ifstream in(file, std::ios::binary);
  if (!in || fs::is_directory(file))
    sensor_json::fail(file.string(), "a calibration of lights (JSON)", "no such file", remedy);
  const std::string text{std::istreambuf_iterator<char>(in), {}};
  const Json json = [&] {
    try {
      return json::parse(text, {.sorted_keys = true});
    } catch (const json::Error&) {
      sensor_json::fail(file.string(), "valid JSON", "something else", remedy);
    }
  }();
  const std::string where = file.filename().string();
  Reader reader(json, where);
  if (reader.number("palpate_lights", 0, 1000, "(version of the format)") != kLightsVersion)
    sensor_json::fail(where + ".palpate_lights", "version 1", sensor_json::shown(json.at("palpate_lights")),
                      "a newer palpate");
  LightCalibration c;
  reader.whole("lights", 3, kMostLights, "", c.stack.lights);
  uint32_t order = 0;
  reader.whole("order", 0, kHighestOrder, "", order);
  c.stack.order = static_cast<int>(order);
  const Json& size = reader.array("size_px", 2, "width, height");
  c.width = Reader::checked_whole(size[0], reader.path("size_px"), 1, kMaxSide_px, "px");
  c.height = Reader::checked_whole(size[1], reader.path("size_px"), 1, kMaxSide_px, "px");
  c.pitch_mm_per_px = reader.number("pitch_mm_per_px", 1e-6, 100, "mm per px");
  reader.number("explained_x", -sensor_json::kHuge, 1, "", c.stack.explained_x);
  reader.number("explained_y", -sensor_json::kHuge, 1, "", c.stack.explained_y);
  c.bands_mm = reader.number("bands_rms_mm", 0, 1e6, "mm");
  c.halves_mm = reader.number("halves_rms_mm", 0, 1e6, "mm");
  c.stack.wx = read_weights(reader, "wx", weights_of(c.stack.lights, c.stack.order));
  c.stack.wy = read_weights(reader, "wy", weights_of(c.stack.lights, c.stack.order));
  c.origin = sensor_json::read_origin(reader);
  reader.finish();
  return c;
}

}  // namespace palpate

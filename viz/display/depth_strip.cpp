#include "viz/display/depth_strip.h"

#include <algorithm>
#include <array>
#include <bit>
#include <chrono>
#include <cinttypes>
#include <cmath>
#include <opencv2/core.hpp>
#include <vector>

#include "capture/files/images/images.h"
#include "capture/files/output_file.h"
#include "capture/open_source.h"
#include "engine/pipeline/surface/surface_sample.h"
#include "engine/pipeline/surface_map.h"
#include "engine/sensor/fit.h"
#include "palpate/error.h"
#include "palpate/pipeline.h"
#include "viz/panels/start/thumbnails.h"
#include "viz/render/format.h"
#include "viz/render/view_state.h"

namespace palpate::viz {
namespace {

namespace fs = std::filesystem;

constexpr double kUnit_mm = 1e-3;  // of the depths that are kept
constexpr uint32_t kMostWidth = 4 * DepthStrip::kHeight;

uint32_t width_of(const FrameFormat& format) {
  const double wide = static_cast<double>(DepthStrip::kHeight) * format.width / format.height;
  return std::clamp(static_cast<uint32_t>(std::lround(wide)), DepthStrip::kHeight / 4, kMostWidth);
}

/// Changes with what a recording is: sizes and times of its files. Snapshots and marks are added to a
/// session.
std::string state_of(const fs::path& input) {
  std::error_code code;
  std::vector<fs::path> files;
  if (const fs::path frames = input / "frames.csv"; fs::exists(frames, code)) {
    files.push_back(frames);
  } else if (fs::is_directory(input, code)) {
    for (const auto& entry : fs::directory_iterator(input, code)) files.push_back(entry.path());
  } else {
    files.push_back(input);
  }
  std::ranges::sort(files);
  std::string state;
  for (const fs::path& file : files)
    state += text("%" PRIuMAX " %lld ", fs::file_size(file, code),
                  static_cast<long long>(fs::last_write_time(file, code).time_since_epoch().count()));
  return state;
}

/// Next to the thumbnail of the same source.
fs::path strip_file(const StripInput& input) {
  const fs::path thumbnail = thumbnail_file(input.input);
  if (thumbnail.empty()) return {};
  const Frame& background = input.background;
  std::string all = state_of(input.input) + sensor_text(input.sensor);
  all.append(reinterpret_cast<const char*>(background.pixels()), background.format.frame_bytes());
  return thumbnail.parent_path() /
         (thumbnail.stem().string() + text("-strip-%016" PRIx64 ".png", hash_of(all)));
}

/// Coarse places first: the order of the reversed bits.
std::vector<uint32_t> order_of_looks() {
  std::vector<uint32_t> order;
  for (uint32_t i = 0; i < 32; ++i) {
    const uint32_t look = (i & 1) << 4 | (i & 2) << 2 | (i & 4) | (i & 8) >> 2 | (i & 16) >> 4;
    if (look < DepthStrip::kLooks) order.push_back(look);
  }
  return order;
}

}  // namespace

DepthStrip::DepthStrip(gpu::Context& context, StripInput input)
    : context_(context),
      input_(std::move(input)),
      file_(strip_file(input_)),
      has_depth_(wants(input_.outputs, Output::Surface)),
      thread_([this] { run(); }) {}

DepthStrip::~DepthStrip() {
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

void DepthStrip::give_way(bool playing) {
  const std::lock_guard lock(mutex_);
  playing_ = playing;
  if (!playing) changed_.notify_all();
}

/// A thumbnail is not worth a message: what is wrong with the recording its player says.
void DepthStrip::run() {
  try {
    if (!load()) measure();
  } catch (const std::exception&) {
  }
  finished_ = true;
}

void DepthStrip::measure() {
  const auto stopped = [this] {
    const std::lock_guard lock(mutex_);
    return stop_;
  };
  const std::unique_ptr<Source> source = open_source(input_.input, input_.sensor);
  source->watch(stopped);
  const uint64_t frames = source->frame_count().value_or(0);
  if (frames < 2) return;
  {
    const std::lock_guard lock(mutex_);
    const uint32_t width = width_of(source->format());
    looks_.reshape(has_depth_ ? FrameFormat{width, kLooks * kHeight, 1, 16}
                              : FrameFormat{width, kLooks * kHeight, 3, 8});
    std::ranges::fill(looks_.bytes, uint8_t{0});
  }
  PipelineOptions options;
  options.outputs = Output::Force | Output::Surface;
  if (wants(input_.outputs, Output::Contacts)) options.outputs |= Output::Contacts;
  options.slots = 1;
  options.separate = true;
  std::optional<Pipeline> pipeline;
  if (has_depth_) {
    pipeline.emplace(context_, for_rectified_frames(input_.sensor), source->format(), options);
    pipeline->set_background(input_.background);
  }
  Frame frame;
  for (const uint32_t look : order_of_looks()) {
    const auto start = std::chrono::steady_clock::now();
    if (stopped() || !source->seek((2 * look + 1) * frames / (2 * kLooks)) || !source->next(frame)) break;
    take(look, frame, pipeline ? pipeline->process(frame) : Result());
    rest(std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count());
  }
  if (measured_ == kLooks) keep();
}

void DepthStrip::take(uint32_t look, const Frame& frame, const Result& result) {
  const FrameFormat& format = looks_.format;
  std::vector<float> depths;
  RgbImage small;
  if (const SurfaceMap& map = surface_of(result); has_depth_ && map.buffer) {
    std::vector<std::array<double, 2>> places;
    for (uint32_t y = 0; y < kHeight; ++y)
      for (uint32_t x = 0; x < format.width; ++x)
        places.push_back(
            {(x + 0.5) * map.width / format.width - 0.5, (y + 0.5) * map.height / kHeight - 0.5});
    depths = sample_depths(context_, map, result.touch.surface->depth_offset_mm, places);
  } else if (!has_depth_) {
    small = scaled_down(frame, format.width, kHeight);
  }
  const std::lock_guard lock(mutex_);
  for (uint32_t y = 0; y < kHeight; ++y)
    for (uint32_t x = 0; x < format.width; ++x) {
      const uint32_t row = look * kHeight + y;
      if (!depths.empty() && result.touch.contact) {
        const double units = static_cast<double>(depths[y * format.width + x]) / kUnit_mm;
        looks_.set(0, x, row, static_cast<uint32_t>(std::lround(std::clamp(units, 0.0, 65535.0))));
      }
      for (uint32_t c = 0; !has_depth_ && c < 3; ++c)
        looks_.set(c, x, row, small.at(x * small.width / format.width, y * small.height / kHeight)[c]);
    }
  done_ |= 1u << look;
  ++measured_;
}

void DepthStrip::rest(double ms) {
  std::unique_lock lock(mutex_);
  changed_.wait_for(lock, std::chrono::duration<double, std::milli>(4 * ms),
                    [this] { return stop_ || !playing_; });
}

bool DepthStrip::load() {
  std::error_code code;
  if (file_.empty() || !fs::exists(file_, code)) return false;
  try {
    const cv::Mat image = read_image(file_);
    const bool fits = image.rows == static_cast<int>(kLooks * kHeight) && image.cols > 0 &&
                      image.cols <= static_cast<int>(kMostWidth) &&
                      image.type() == (has_depth_ ? CV_16UC1 : CV_8UC3);
    if (!fits) return false;
    const std::lock_guard lock(mutex_);
    looks_.reshape(
        {static_cast<uint32_t>(image.cols), kLooks * kHeight, has_depth_ ? 1u : 3u, has_depth_ ? 16u : 8u});
    for (int y = 0; y < image.rows; ++y)
      for (int x = 0; x < image.cols; ++x)
        if (has_depth_)
          looks_.set(0, static_cast<uint32_t>(x), static_cast<uint32_t>(y), image.at<uint16_t>(y, x));
        else
          for (uint32_t c = 0; c < 3; ++c)
            looks_.set(c, static_cast<uint32_t>(x), static_cast<uint32_t>(y),
                       image.at<cv::Vec3b>(y, x)[2 - static_cast<int>(c)]);
    done_ = (1u << kLooks) - 1;
  } catch (const Error&) {
    return false;
  }
  from_file_ = true;
  measured_ = kLooks;
  return true;
}

/// In place of what was kept of this source before.
void DepthStrip::keep() const {
  if (file_.empty()) return;
  make_output_folder(file_.parent_path());
  write_whole(file_, encode_image(looks_, ".png"));
  const std::string begin = file_.filename().string().substr(0, file_.filename().string().rfind('-') + 1);
  std::error_code code;
  std::vector<fs::path> old;
  for (const auto& entry : fs::directory_iterator(file_.parent_path(), code))
    if (entry.path() != file_ && entry.path().filename().string().starts_with(begin))
      old.push_back(entry.path());
  for (const fs::path& path : old) fs::remove(path, code);
}

double DepthStrip::deepest_mm(uint32_t index) const {
  const std::lock_guard lock(mutex_);
  if (!has_depth_ || (done_ >> index & 1) == 0) return 0;
  uint32_t most = 0;
  for (uint32_t y = index * kHeight; y < (index + 1) * kHeight; ++y)
    for (uint32_t x = 0; x < looks_.format.width; ++x) most = std::max(most, looks_.at(0, x, y));
  return most * kUnit_mm;
}

/// The look that shows `part` (0 to 1) of the recording; kLooks where it is not measured yet.
uint32_t DepthStrip::nearest_measured(double part) const {
  const auto look = std::min(static_cast<uint32_t>(part * kLooks), kLooks - 1);
  return done_ >> look & 1 ? look : kLooks;
}

void DepthStrip::draw(Frame& picture, uint32_t width, uint32_t height, ColourMap map) const {
  constexpr uint8_t kGround = 24;  // where there is nothing yet
  picture.reshape({width, height, 3, 8});
  std::ranges::fill(picture.bytes, kGround);
  double range_mm = ViewState::kLeastRange_mm;
  for (uint32_t look = 0; look < kLooks; ++look) range_mm = std::max(range_mm, deepest_mm(look));
  const std::lock_guard lock(mutex_);
  if (done_ == 0) return;
  const uint32_t tile = std::clamp(height * looks_.format.width / kHeight, 1u, width);
  const uint32_t tiles = std::clamp(width / (tile + 2), 1u, kLooks);
  for (uint32_t i = 0; i < tiles; ++i) {
    const uint32_t look = nearest_measured((i + 0.5) / tiles);
    if (look == kLooks) continue;
    const auto left = static_cast<uint32_t>((2.0 * i + 1) * width / (2.0 * tiles) - 0.5 * tile);
    for (uint32_t y = 0; y < height; ++y)
      for (uint32_t x = 0; x < tile && left + x < width; ++x) {
        const uint32_t u = x * looks_.format.width / tile, v = look * kHeight + y * kHeight / height;
        if (has_depth_) {
          const auto colour = colour_of(map, std::min(1.0, looks_.at(0, u, v) * kUnit_mm / range_mm));
          for (uint32_t c = 0; c < 3; ++c)
            picture.set(c, left + x, y, static_cast<uint32_t>(std::lround(255 * colour[c])));
        } else {
          for (uint32_t c = 0; c < 3; ++c) picture.set(c, left + x, y, looks_.at(c, u, v));
        }
      }
  }
}

}  // namespace palpate::viz

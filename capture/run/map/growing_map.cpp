#include "capture/run/map/growing_map.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <mutex>
#include <optional>
#include <stop_token>
#include <thread>
#include <utility>

#include "capture/files/map_files.h"
#include "capture/files/output_file.h"
#include "capture/run/map/touched_depths.h"
#include "engine/base/give_way.h"
#include "engine/map/object_map.h"

namespace palpate {
namespace {

using Clock = std::chrono::steady_clock;

Pose pose_of(const ObjectPose& told, uint32_t track) {
  Pose pose;
  pose.state = told.state;
  pose.track = track;
  pose.keys = told.keys;
  pose.residual_mm = told.residual_mm;
  for (int row = 0; row < 3; ++row) {
    const auto r = static_cast<size_t>(row);
    pose.motion.shift_mm[row] = told.translation_mm[r];
    for (int column = 0; column < 3; ++column)
      pose.motion.turn(row, column) = told.rotation[3 * r + static_cast<size_t>(column)];
  }
  return pose;
}

/// An object is there that a map could be made of.
bool on_track(const Touch& touch) {
  return touch.object && touch.surface &&
         (touch.object->state == PoseState::Begun || touch.object->state == PoseState::Tracked);
}

/// Every other row and column where all four pixels were seen.
void halve(SeenMap& map) {
  SeenMap half = map;
  half.width = map.width / 2;
  half.height = map.height / 2;
  half.pitch_mm = 2 * map.pitch_mm;
  half.left_mm += map.pitch_mm / 2;
  half.top_mm += map.pitch_mm / 2;
  half.height_mm.clear();
  for (uint32_t y = 0; y < half.height; ++y)
    for (uint32_t x = 0; x < half.width; ++x) {
      const size_t at = size_t{2} * y * map.width + size_t{2} * x, below = at + map.width;
      half.height_mm.push_back(
          (map.height_mm[at] + map.height_mm[at + 1] + map.height_mm[below] + map.height_mm[below + 1]) / 4);
    }
  map = std::move(half);
}

std::shared_ptr<const SeenMap> look_at(const MapSnapshot& map) {
  auto out = std::make_shared<SeenMap>();
  out->pieces = static_cast<uint32_t>(map.pieces.size());
  out->closed = map.loops - map.refused;
  out->missed = map.missed;
  if (map.pieces.empty()) return out;
  const MapPiece& largest = map.pieces.front();
  const FusedMap& fused = largest.map;
  out->keys = static_cast<uint32_t>(largest.keys.size());
  out->covered_mm2 = fused.covered_mm2();
  out->error_mm = stated_error_mm(fused);
  for (const MapKey& key : largest.keys) {
    const Eigen::Vector3d place = key.motion.inverse() * Eigen::Vector3d(0, 0, key.middle_mm[2]);
    out->way_mm.push_back({place[0], place[1]});
  }
  out->width = fused.width;
  out->height = fused.height;
  out->pitch_mm = fused.pitch_mm;
  out->left_mm = fused.left_mm;
  out->top_mm = fused.top_mm;
  out->height_mm = fused.height_mm;
  while (out->height_mm.size() > SeenMap::kMost && out->width > 1 && out->height > 1) halve(*out);
  std::vector<float> seen;
  std::ranges::copy_if(out->height_mm, std::back_inserter(seen), [](float z) { return !std::isnan(z); });
  if (seen.empty()) return out;
  const auto hundredth = static_cast<std::ptrdiff_t>(seen.size() / 100);
  const auto low = seen.begin() + hundredth, high = seen.end() - 1 - hundredth;
  std::ranges::nth_element(seen, low);
  std::nth_element(low, high, seen.end());
  out->low_mm = double{*low};
  out->high_mm = double{*high};
  return out;
}

}  // namespace

struct GrowingMap::Work {
  struct Taken {
    std::vector<float> depth_mm;
    bool touched = false;
    double depth_sd_mm = 0;
    Pose pose;
    uint64_t number = 0;
  };

  Work(const FrameFormat& frame_format, double pitch)
      : format(frame_format), pitch_mm(pitch), depths(frame_format, pitch, kContactShare) {}

  void run(const std::stop_token& stop);
  void take(const Taken& frame);
  bool publish();
  bool work_on();

  const FrameFormat format;
  const double pitch_mm;

  mutable std::mutex mutex;
  std::condition_variable_any changed;
  std::optional<Taken> next;
  std::vector<float> spare;  ///< memory of a frame that is in the map
  bool busy = false, begin_anew = false;
  std::shared_ptr<const MapSnapshot> snapshot;
  std::shared_ptr<const SeenMap> seen;
  std::vector<std::array<double, 2>> pad_mm;

  // State of the thread:
  TouchedDepths depths;
  std::optional<ObjectMap> map;
  Clock::duration spent{};          ///< on the work since the last map
  Clock::time_point fuses_after{};  ///< half of the time is left to others

  std::jthread thread;  ///< last: it uses the rest
};

void GrowingMap::Work::take(const Taken& frame) {
  map->add(depths.of(frame.depth_mm, frame.touched, frame.depth_sd_mm), frame.pose, frame.number);
  std::vector<std::array<double, 2>> corners;
  if (const std::optional<MapPlace> place = map->place(); place && place->piece == 0) {
    const RigidMotion back = place->motion.inverse();
    const double x = 0.5 * (format.width - 1) * pitch_mm, y = 0.5 * (format.height - 1) * pitch_mm;
    for (const auto& [a, b] : {std::pair{-x, -y}, {x, -y}, {x, y}, {-x, y}}) {
      const Eigen::Vector3d corner = back * Eigen::Vector3d(a, b, 0);
      corners.push_back({corner[0], corner[1]});
    }
  }
  const std::lock_guard lock(mutex);
  if (!begin_anew) pad_mm = std::move(corners);
}

/// Shows what has changed of the map; false: nothing.
bool GrowingMap::Work::publish() {
  const std::shared_ptr<const MapSnapshot> now = map->snapshot();
  {
    const std::lock_guard lock(mutex);
    if (now == snapshot || now->keys == 0) return false;
  }
  const std::shared_ptr<const SeenMap> looked = look_at(*now);
  const std::lock_guard lock(mutex);
  if (begin_anew) return false;
  snapshot = now;
  seen = looked;
  return true;
}

/// One piece of work; what the last map took of time is left to others before the next is fused.
bool GrowingMap::Work::work_on() {
  const Clock::time_point begin = Clock::now();
  const bool rests = begin < fuses_after;
  const bool worked = map->work(rests ? ObjectMap::Work::Places : ObjectMap::Work::All);
  spent += Clock::now() - begin;
  if (publish()) fuses_after = Clock::now() + std::exchange(spent, {});
  return worked;
}

void GrowingMap::Work::run(const std::stop_token& stop) {
  give_way();
  map.emplace();
  while (!stop.stop_requested()) {
    std::optional<Taken> frame;
    bool anew = false;
    {
      const std::lock_guard lock(mutex);
      frame = std::exchange(next, {});
      anew = std::exchange(begin_anew, false);
      busy = true;
    }
    if (anew) {
      map.emplace();
      fuses_after = {};
      spent = {};
    }
    if (frame) take(*frame);
    const bool worked = work_on();
    std::unique_lock lock(mutex);
    if (frame) spare = std::move(frame->depth_mm);
    const auto called = [this] { return next || begin_anew; };
    if (worked || called()) continue;
    if (Clock::now() < fuses_after) {
      changed.wait_until(lock, stop, fuses_after, called);
      continue;
    }
    busy = false;
    changed.notify_all();
    changed.wait(lock, stop, called);
  }
}

GrowingMap::GrowingMap(double pitch_mm) : pitch_mm_(pitch_mm) {}
GrowingMap::~GrowingMap() = default;

bool GrowingMap::wants(const Touch& touch) const {
  if (!on_track(touch)) return false;
  if (!work_) return true;
  const std::lock_guard lock(work_->mutex);
  return !work_->next;
}

void GrowingMap::add(const Touch& touch, const FrameFormat& format, std::span<const float> depth_mm,
                     uint32_t round) {
  if (!wants(touch) || depth_mm.size() != size_t{format.width} * format.height) return;
  constexpr uint32_t kTracks = 1u << 24;  // of a round
  const uint32_t track = round * kTracks + touch.object->track;
  last_track_ = track;
  if (track == ended_track_) return;
  if (!work_) {
    work_ = std::make_unique<Work>(format, pitch_mm_);
    work_->thread = std::jthread([w = work_.get()](const std::stop_token& stop) { w->run(stop); });
  }
  Work& w = *work_;
  Work::Taken frame;
  {
    const std::lock_guard lock(w.mutex);
    frame.depth_mm = std::move(w.spare);
  }
  frame.depth_mm.assign(depth_mm.begin(), depth_mm.end());
  frame.touched = touch.contact;
  frame.depth_sd_mm = touch.surface->depth_sd_mm;
  frame.pose = pose_of(*touch.object, track);
  frame.number = touch.sequence;
  {
    const std::lock_guard lock(w.mutex);
    w.next = std::move(frame);
    w.busy = true;
  }
  w.changed.notify_all();
}

void GrowingMap::restart() {
  ended_track_ = last_track_;
  if (!work_) return;
  {
    const std::lock_guard lock(work_->mutex);
    work_->next.reset();
    work_->snapshot.reset();
    work_->seen.reset();
    work_->pad_mm.clear();
    work_->begin_anew = work_->busy = true;
  }
  work_->changed.notify_all();
}

void GrowingMap::finish() {
  if (!work_) return;
  std::unique_lock lock(work_->mutex);
  work_->changed.wait(lock, [this] { return !work_->busy; });
}

std::shared_ptr<const SeenMap> GrowingMap::seen() const {
  if (!work_) return nullptr;
  const std::lock_guard lock(work_->mutex);
  return work_->seen;
}

std::vector<std::array<double, 2>> GrowingMap::pad_mm() const {
  if (!work_) return {};
  const std::lock_guard lock(work_->mutex);
  return work_->pad_mm;
}

std::vector<std::string> GrowingMap::write(const std::filesystem::path& folder) const {
  std::shared_ptr<const MapSnapshot> map;
  if (work_) {
    const std::lock_guard lock(work_->mutex);
    map = work_->snapshot;
  }
  if (!map || map->pieces.empty()) return {};
  make_output_folder(folder);
  std::vector<std::string> names = write_map(folder, *map);
  write_whole(folder / "map.json", std::string_view(map_json(*map).dump(2) + "\n"));
  names.emplace_back("map.json");
  return names;
}

}  // namespace palpate

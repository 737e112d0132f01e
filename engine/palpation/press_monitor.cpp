#include "engine/palpation/press_monitor.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

#include "engine/base/text.h"
#include "engine/lump/estimator.h"
#include "engine/palpation/hand/growing_scan.h"
#include "engine/palpation/hand/light_relief.h"
#include "engine/palpation/scan.h"
#include "engine/sensor/fit.h"
#include "palpate/error.h"

namespace palpate {
namespace {

constexpr double kPitch_mm = 1.25;       // as the network has it
constexpr double kLeastFraction = 0.01;  // force over area and modulus from which on something presses
constexpr double kNoPress = 1.5;         // times that: what stays below is the gauge's noise
constexpr double kTop = 0.995;           // of the highest force: the highest load
constexpr double kLeastPeak_gray = 10;
constexpr double kTiltLoad = 4;  // times the least force: from so much on a tilt is told
constexpr double kMostTilt_sd_deg = 2;
constexpr size_t kFewestLoads = 2, kMostFrames = 2000;

double least_N(const BlockSetting& b) {
  return kLeastFraction * 1e-6 * b.block_mm[0] * b.block_mm[1] * b.young_Pa;
}

bool sees_all(const std::array<double, 2>& window_mm, const BlockSetting& b) {
  for (size_t axis = 0; axis < 2; ++axis)
    if (std::abs(b.window_mm[axis]) + b.block_mm[axis] / 2 > window_mm[axis] / 2) return false;
  return true;
}

double peak_of(const PressureMap& map) {
  float peak = 0;
  for (const float value : map.values)
    if (std::isfinite(value)) peak = std::max(peak, value);
  return static_cast<double>(peak);
}

uint32_t loads_seen(const PressFrames& frames, double highest_N, uint32_t wanted) {
  uint32_t seen = 0;
  for (const double at_N : even_loads(kTop * highest_N, wanted))
    seen += !frames_near(frames.force_N, at_N, kTop * highest_N).empty();
  return seen;
}

}  // namespace

void read_press(const PressureNodes& nodes, const PressFrames& frames, const PressSetup& setup,
                PressAnswer& answer) {
  answer.window_mm = setup.block.window_mm;
  double highest_N = 0;
  for (const double force_N : frames.force_N) highest_N = std::max(highest_N, force_N);
  std::vector<LoadSums> loads;
  for (const double at_N : even_loads(kTop * highest_N, setup.loads)) {
    const std::vector<size_t> near = frames_near(frames.force_N, at_N, kTop * highest_N);
    if (near.empty()) continue;
    LoadSums load;
    for (const size_t i : near) {
      load.nodes.add(frames.nodes[i]);
      load.force_N += frames.force_N[i] / static_cast<double>(near.size());
    }
    answer.loads_N.push_back(load.force_N);
    loads.push_back(std::move(load));
  }
  const lump::Observation observation = press_observation(nodes, loads, setup.block);
  answer.saturated_fraction = observation.saturated_fraction;
  const double peak_gray = peak_of(observation.pressure_Pa.back()) / nodes.Pa_per_gray();
  if (observation.saturated_fraction == 0 && peak_gray < kLeastPeak_gray) {
    answer.trouble =
        text("press too light: %.2g gray levels at its peak, %g are needed", peak_gray, kLeastPeak_gray);
    return;
  }
  if (loads.size() < kFewestLoads) {
    answer.trouble = text("too few loads: frames near %zu of %u while the force rose; press more slowly",
                          loads.size(), setup.loads);
    return;
  }
  try {
    static const lump::Estimator estimator = lump::named_estimator("refined", lump::load_network(""), {});
    answer.estimate = estimator(observation);
  } catch (const Error& error) {
    answer.trouble = error.what();
  }
}

PressMonitor::PressMonitor(const Sensor& sensor, const Frame& background, PressSetup setup)
    : setup_(std::move(setup)), detector_(least_N(setup_.block)) {
  status_.wanted = setup_.loads;
  if (reads_pressure(sensor) && sensor.pitch_mm_per_px > 0 && background.format.channels == 1)
    nodes_.emplace(sensor, background, kPitch_mm);
  if (nodes_ && !setup_.placed) scan_ = std::make_unique<GrowingScan>(sensor, background);
  next_block_ = setup_.block;
  take_block();
}

PressMonitor::~PressMonitor() = default;

void PressMonitor::set_block(const BlockSetting& block) {
  bool right = block.young_Pa > 0 && std::isfinite(block.young_Pa);
  for (const double side : block.block_mm) right = right && side > 0 && std::isfinite(side);
  if (!right)
    throw Error(Failure::Usage, "a block's sizes and modulus above 0",
                text("%g x %g x %g mm, %g Pa", block.block_mm[0], block.block_mm[1], block.block_mm[2],
                     block.young_Pa),
                "what was measured at a place without a lump");
  const std::lock_guard lock(mutex_);
  next_block_ = block;
  next_block_->window_mm = status_.block.window_mm;
}

/// Takes over the block that was set last, between two presses.
void PressMonitor::take_block() {
  const std::lock_guard lock(mutex_);
  if (!next_block_ || detector_.pressing()) return;
  setup_.block = status_.block = *std::exchange(next_block_, {});
  detector_.set_least(least_N(setup_.block));
  lacking_.clear();
  if (!nodes_)
    lacking_ = "not calibrated in pascals: needs a sensor file with surface.reading elastic";
  else if (const auto window_mm = nodes_->window_mm(); !setup_.force && !sees_all(window_mm, setup_.block))
    lacking_ = text("needs the force on the whole block (the window sees %.3g x %.3g mm of it): --gauge",
                    window_mm[0], window_mm[1]);
  status_.trouble = lacking_;
}

std::optional<double> PressMonitor::force_at(const Frame& frame, std::optional<NodeSums>& read) const {
  if (setup_.force) return setup_.force(frame.sequence);
  read = nodes_->read(frame);
  return nodes_->window_force_N(*read);
}

void PressMonitor::begin() {
  now_ = {};
  frames_ = {};
  contact_ = false;
  stride_ = 1;
  taken_ = 0;
  if (scan_) scan_->begin_press();
}

void PressMonitor::add(const Frame& frame, const Touch& touch) {
  take_block();
  if (!lacking_.empty()) return;
  using Step = PressDetector::Step;
  if (frame.after_gap && detector_.pressing()) end("broken off: frames are missing");
  std::optional<NodeSums> read;
  const std::optional<double> force_N = force_at(frame, read);
  if (!force_N || !std::isfinite(*force_N)) {
    if (detector_.pressing()) end("broken off: the gauge has no reading");
    report({}, frame.sequence);
    return;
  }
  const Step step = detector_.add(*force_N);
  if (step == Step::Over) end("");
  if (step == Step::Began) {
    begin();
    now_.first_frame = frame.sequence;
  }
  if (detector_.pressing()) {
    now_.last_frame = frame.sequence;
    now_.time_s = 1e-9 * static_cast<double>(frame.time_ns);
    if (scan_) scan_->add(frame, *force_N);
    if (contact_ && !touch.contact)
      end(text("lost contact: the gauge reads %.3g N, the sensor nothing", *force_N));
    else
      keep(*force_N, read ? std::move(*read) : nodes_->read(frame));
    contact_ = contact_ || touch.contact;
  }
  report(force_N, frame.sequence);
}

void PressMonitor::keep(double force_N, NodeSums nodes) {
  if (taken_++ % stride_ != 0) return;
  frames_.force_N.push_back(force_N);
  frames_.nodes.push_back(std::move(nodes));
  if (frames_.nodes.size() < kMostFrames) return;
  for (size_t i = 1; 2 * i < frames_.nodes.size(); ++i) {
    frames_.force_N[i] = frames_.force_N[2 * i];
    frames_.nodes[i] = std::move(frames_.nodes[2 * i]);
  }
  frames_.force_N.resize(kMostFrames / 2);
  frames_.nodes.resize(kMostFrames / 2);
  stride_ *= 2;
}

void PressMonitor::end(const std::string& trouble) {
  if (detector_.pressing()) detector_.break_off();
  if (detector_.highest_N() < kNoPress * least_N(setup_.block)) return;
  PressAnswer answer = std::exchange(now_, {});
  answer.press = ++presses_;
  answer.highest_N = detector_.highest_N();
  answer.trouble = trouble;
  if (scan_)
    scan_->end_press(trouble, {setup_.block.block_mm, setup_.block.young_Pa, setup_.loads, kPitch_mm});
  if (trouble.empty() && !setup_.placed)
    answer.trouble =
        "where the pad lay in the block is not known: palpate lump scan --by-hand puts presses together";
  {
    const std::lock_guard lock(mutex_);
    ++pending_;
    status_.estimating = true;
  }
  auto frames = std::make_shared<PressFrames>(std::exchange(frames_, {}));
  background_.add([this, frames, answer, setup = setup_]() mutable {
    if (answer.trouble.empty()) read_press(*nodes_, *frames, setup, answer);
    publish(std::move(answer));
    return std::string();
  });
}

void PressMonitor::publish(PressAnswer answer) {
  const std::lock_guard lock(mutex_);
  status_.estimating = --pending_ > 0;
  answers_.push_back(answer);
  status_.last = std::move(answer);
}

std::optional<lump::PadTilt> PressMonitor::tilt(double force_N) const {
  if (frames_.nodes.empty() || force_N < kTiltLoad * least_N(setup_.block)) return std::nullopt;
  double noise_Pa = 0, limited = 0;
  PressureMap map = nodes_->map(frames_.nodes.back(), noise_Pa, limited);
  hide_untouched(map);
  const auto touched =
      std::count_if(map.values.begin(), map.values.end(), [](float value) { return std::isfinite(value); });
  if (2 * static_cast<size_t>(touched) < map.values.size()) return std::nullopt;
  const lump::PadTilt found = lump::pad_tilt(map, {setup_.block.young_Pa, setup_.block.block_mm[2]});
  // A number that is not there is not within the limit either.
  return std::max(found.x_sd_deg, found.y_sd_deg) <= kMostTilt_sd_deg ? std::optional(found) : std::nullopt;
}

void PressMonitor::report(std::optional<double> force_N, uint64_t frame) {
  const bool pressing = detector_.pressing();
  const uint32_t seen = pressing ? loads_seen(frames_, detector_.highest_N(), setup_.loads) : 0;
  const std::optional<lump::PadTilt> tilted = pressing ? tilt(force_N.value_or(0)) : std::nullopt;
  const std::lock_guard lock(mutex_);
  status_.pressing = pressing;
  status_.tilt = tilted;
  status_.force_N = force_N.value_or(0);
  status_.highest_N = detector_.highest_N();
  status_.loads = seen;
  status_.trouble =
      force_N ? "" : text("the gauge has no reading at frame %llu", static_cast<unsigned long long>(frame));
}

PressStatus PressMonitor::status() const {
  const std::lock_guard lock(mutex_);
  return status_;
}

std::vector<PressAnswer> PressMonitor::finish() {
  if (detector_.pressing()) {
    now_.unfinished = true;
    end("");
  }
  background_.finish();
  const std::lock_guard lock(mutex_);
  status_.pressing = false;
  status_.tilt.reset();
  return answers_;
}

std::string describe(const PressAnswer& a) {
  std::string line =
      text("press %llu, frames %llu to %llu, ", static_cast<unsigned long long>(a.press),
           static_cast<unsigned long long>(a.first_frame), static_cast<unsigned long long>(a.last_frame));
  if (a.unfinished) line += "not over at the end, ";
  if (!a.estimate) return line + text("up to %.3g N: ", a.highest_N) + a.trouble;
  line += text("%zu loads up to %.3g N: ", a.loads_N.size(), a.loads_N.back());
  if (a.saturated_fraction > 0) line += text("%.2g %% of the window saturated; ", 100 * a.saturated_fraction);
  bool first = true;
  for (const auto& [name, value] : estimate_rows(*a.estimate)) {
    if (name == "evidence" || name == "method") continue;
    if (!std::exchange(first, false)) line += name == "reason" ? "; " : "; " + name + " ";
    line += value;
  }
  return line;
}

}  // namespace palpate

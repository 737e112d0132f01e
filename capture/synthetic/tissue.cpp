#include "capture/synthetic/tissue.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <mutex>
#include <span>
#include <vector>

#include "capture/synthetic/optics.h"
#include "capture/synthetic/scene.h"
#include "capture/synthetic/tissue_hand.h"
#include "engine/fem/large_strain/extrapolation.h"
#include "engine/tissue/map_sampling.h"
#include "palpate/error.h"

namespace palpate {
namespace {

constexpr double kStep_s = 0.5, kHold_s = 0.5, kRest_s = 0.6, kLift_s = 0.8;
constexpr double kEvenFraction = 0.25;  // of 255 gray, by a block without a lump

/// The optics' field and noise know the built-in sensor's options.
SyntheticOptions optics_of(const TissueOptions& o) {
  SyntheticOptions s;
  s.width = o.width;
  s.height = o.height;
  s.seed = o.seed;
  s.noise = o.noise;
  s.falloff = o.falloff;
  s.rate_Hz = o.rate_Hz;
  return s;
}

Script script_of(const TissueOptions& o) {
  Script script = {{0, 0, 0, 0}, {kRest_s, 0, 0, 0}};
  double t = kRest_s;
  for (uint32_t k = 1; k <= o.loads; ++k) {
    const double force_N = o.force_N * k / o.loads;
    script.push_back({t += kStep_s, 0, 0, force_N});
    script.push_back({t += kHold_s, 0, 0, force_N});
  }
  script.push_back({t += kLift_s, 0, 0, 0});
  script.push_back({t += kRest_s, 0, 0, 0});
  return script;
}

/// A window pressed by a block is the same block for every window: its solution is kept.
std::shared_ptr<const fem::LargeStrainResult> solved(const TissueOptions& o) {
  static std::mutex guard;
  static std::map<std::string, std::shared_ptr<const fem::LargeStrainResult>> kept;
  TissueOptions block = o;
  block.x_mm = block.y_mm = 0;
  block.seed = 1;
  block.falloff = 0;
  block.hand = 0;
  block.width = block.height = 64;
  const std::string key = to_string(block);
  const std::lock_guard lock(guard);
  auto& result = kept[key];
  if (result) return result;
  std::vector<fem::PressLoad> loads;
  for (const double fraction : {0.1, 0.25, 0.5, 0.75, 1.0}) loads.push_back({{}, fraction * o.force_N});
  fem::LargeStrainResult found = solve_extrapolated(o.scene, loads);
  if (!found.converged)
    throw Error(Failure::Input,
                "a synthetic block that can be pressed with " + std::to_string(o.force_N) + " N",
                "no convergence beyond " + std::to_string(found.last_force_N) + " N", "a smaller force=");
  if (kept.size() > 8) kept.clear();
  return kept[key] = std::make_shared<const fem::LargeStrainResult>(std::move(found));
}

}  // namespace

struct TissueSensor::Impl {
  TissueOptions options;
  SyntheticOptions optics_options;
  std::optional<TissueHand> hand;
  Script script;
  uint64_t frames;
  std::shared_ptr<const fem::LargeStrainResult> press;
  PressedTissue tissue;  // of a hand
  double pitch_mm, gray_per_Pa;
  std::vector<double> untouched_gray, touch_light;  // of each pixel, the same in every frame
  optics::NormalNoise normal;

  explicit Impl(const TissueOptions& o)
      : options(o),
        optics_options(optics_of(o)),
        hand(o.hand > 0 ? std::optional<TissueHand>(o) : std::nullopt),
        script(hand ? hand->script() : script_of(o)),
        frames(static_cast<uint64_t>(std::round(script.back().time_s * o.rate_Hz))),
        press(solved(o)),
        pitch_mm(optics::pitch_mm(optics_options)),
        gray_per_Pa(1e-6 * tissue_gray_per_MPa(o)) {
    light_pixels();
    if (!hand) return;
    tissue.block_mm = o.scene.block_mm;
    tissue.young_Pa = o.scene.young_Pa;
    for (const fem::PressedBlock& load : press->loads) {
      tissue.pressure_Pa.push_back(load.pressure_Pa);
      tissue.force_N.push_back(load.force_N);
      tissue.press_mm.push_back(load.press_mm);
    }
  }

  double x_mm(uint32_t x) const { return (x - (options.width - 1) / 2.0) * pitch_mm; }
  double y_mm(uint32_t y) const { return (y - (options.height - 1) / 2.0) * pitch_mm; }

  void light_pixels() {
    const optics::Field field(optics_options);
    std::vector<float> pattern(options.width);
    untouched_gray.reserve(size_t{options.width} * options.height);
    touch_light.reserve(untouched_gray.capacity());
    for (uint32_t y = 0; y < options.height; ++y) {
      normal.row(options.seed * 2 + 1, 0, y, options.width, pattern.data());
      for (uint32_t x = 0; x < options.width; ++x) {
        untouched_gray.push_back(
            field.stray_gray(x_mm(x), y_mm(y)) +
            (options.noise ? optics::kPattern_gray * static_cast<double>(pattern[x]) : 0));
        touch_light.push_back(gray_per_Pa * field.touch(x_mm(x), y_mm(y)));
      }
    }
  }

  bool past_end(uint64_t sequence) const {
    return options.repeat != 0 && sequence / frames >= options.repeat;
  }
  double force_N(uint64_t sequence) const {
    return at(script, static_cast<double>(sequence % frames) / options.rate_Hz).force_N;
  }
  /// Pressure over the block at a force.
  PressureMap map_at_force(double force_N) const {
    const std::vector<fem::PressedBlock>& loads = press->loads;
    size_t k = 0;
    while (k + 2 < loads.size() && loads[k + 1].force_N < force_N) ++k;
    const fem::PressedBlock &a = loads[k], &b = loads[k + 1];
    const double t = (force_N - a.force_N) / (b.force_N - a.force_N);
    PressureMap map = a.pressure_Pa;
    for (size_t i = 0; i < map.values.size(); ++i)
      map.values[i] =
          static_cast<float>(force_N * ((1 - t) * static_cast<double>(a.pressure_Pa.values[i]) / a.force_N +
                                        t * static_cast<double>(b.pressure_Pa.values[i]) / b.force_N));
    return map;
  }
  HeldPose held(uint64_t sequence) const {
    if (!hand) return {{options.x_mm, options.y_mm}, 0, {}};
    return hand->held(static_cast<double>(sequence % frames) / options.rate_Hz);
  }

  /// What the window sees at a moment.
  struct Seen {
    double force_N = 0;
    HeldPose pose;
    PressureMap map;  // over the block; of a hand under the window
  };
  Seen seen(uint64_t sequence) const {
    Seen s{force_N(sequence), held(sequence), {}};
    if (s.force_N <= 0) return s;
    const std::array<double, 2> window_mm = {options.width * pitch_mm, options.height * pitch_mm};
    s.map = hand ? pressure_under(tissue, s.pose, s.force_N, window_mm) : map_at_force(s.force_N);
    return s;
  }
  /// Pressure on the window at a place of the block whose map says `map_Pa`; 0 beside the block.
  double felt_Pa(const Seen& s, double x_mm, double y_mm, double map_Pa) const {
    if (std::abs(x_mm) > options.scene.block_mm[0] / 2 || std::abs(y_mm) > options.scene.block_mm[1] / 2)
      return 0;
    const double level_Pa = std::max(0.0, map_Pa);
    return hand ? level_Pa * hand->share_at(skin_place(tissue, s.pose, s.force_N, x_mm, y_mm)) : level_Pa;
  }
  double pressure_Pa(const Seen& s, double u_mm, double v_mm) const {
    const auto [x, y] = s.pose.block(u_mm, v_mm);
    return felt_Pa(s, x, y, hand ? map_at(s.map, u_mm, v_mm) : map_at(s.map, x, y));
  }

  /// pressure_Pa of the pixels of a frame, row by row.
  class PixelPressure {
   public:
    PixelPressure(const Impl& impl, const Seen& now)
        : impl_(impl), now_(now), along_(now.pose.block(1, 0)), rows_(now.map, columns(impl, now)) {
      for (size_t c = 0; c < 2; ++c) along_[c] -= now.pose.at_mm[c];
    }
    void read(uint32_t y, std::span<double> out_Pa) {
      const double v = impl_.y_mm(y);
      const auto row = now_.pose.block(0, v);
      rows_.read(impl_.hand ? v : row[1], out_Pa);
      for (uint32_t x = 0; x < out_Pa.size(); ++x) {
        const double u = impl_.x_mm(x);
        out_Pa[x] = impl_.felt_Pa(now_, row[0] + u * along_[0], row[1] + u * along_[1], out_Pa[x]);
      }
    }

   private:
    /// Columns of a hand's map, under the window; or of the block's, to which a window without a hand is
    /// never turned.
    static std::vector<double> columns(const Impl& impl, const Seen& now) {
      std::vector<double> out(impl.options.width);
      for (uint32_t x = 0; x < out.size(); ++x) out[x] = impl.x_mm(x) + (impl.hand ? 0 : now.pose.at_mm[0]);
      return out;
    }
    const Impl& impl_;
    const Seen& now_;
    std::array<double, 2> along_;  // over the block, by one mm along a row
    MapRows rows_;
  };

  /// `sequence`: none: untouched, without noise.
  void render(std::optional<uint64_t> sequence, Frame& frame) const {
    const uint32_t w = options.width, h = options.height;
    const Seen now = sequence ? seen(*sequence) : Seen{};
    std::optional<PixelPressure> pressure;
    if (now.force_N > 0) pressure.emplace(*this, now);
    const double per_e = 255 / optics::kFullWell_e, read_gray = per_e * optics::kReadNoise_e;
    std::vector<float> noise(w, 0.0f);
    std::vector<double> gray(w), pressed_Pa(w);
    for (uint32_t y = 0; y < h; ++y) {
      const size_t first = size_t{y} * w;
      std::copy_n(untouched_gray.begin() + static_cast<std::ptrdiff_t>(first), w, gray.begin());
      if (pressure) {
        pressure->read(y, pressed_Pa);
        for (uint32_t x = 0; x < w; ++x) gray[x] += pressed_Pa[x] * touch_light[first + x];
      }
      if (options.noise && sequence) {
        normal.row(options.seed * 2, *sequence, y, w, noise.data());
        for (uint32_t x = 0; x < w; ++x)
          gray[x] += static_cast<double>(noise[x]) *
                     std::sqrt(read_gray * read_gray + per_e * std::max(0.0, gray[x] - optics::kBlack_gray));
      }
      uint8_t* row = frame.row(0, y);
      for (uint32_t x = 0; x < w; ++x)
        row[x] = static_cast<uint8_t>(std::lround(std::clamp(gray[x], 0.0, 255.0)));
    }
  }
};

double tissue_gray_per_MPa(const TissueOptions& o) {
  const double even_MPa = o.force_N / (o.scene.block_mm[0] * o.scene.block_mm[1]);
  return kEvenFraction * 255 / even_MPa;
}

Sensor tissue_sensor(const TissueOptions& o) {
  Sensor s;
  s.name = "synthetic palpation window";
  s.pitch_mm_per_px = optics::pitch_mm(optics_of(o));
  s.size_px = {o.width, o.height};
  s.channels = 1;
  s.bit_depth = 8;
  s.signal = Signal::Brighter;
  s.threshold_gray = 4;
  s.saturation_gray = 255;
  s.reading = SurfaceReading::Elastic;
  s.elastic.gray_per_MPa = tissue_gray_per_MPa(o);
  // A soft pad on a stiff window: its own deflection is what the surface shows.
  s.elastic.young_MPa = 0.03;
  s.elastic.thickness_mm = 2;
  s.elastic.relative_sd = 0.01;
  ForceCalibration f;
  f.c1_N_per_gray = s.pitch_mm_per_px * s.pitch_mm_per_px / s.elastic.gray_per_MPa;
  f.gray_max = 1.5 * o.force_N / f.c1_N_per_gray;
  f.residual_sd_N = 0.003 * o.force_N;
  f.covariance = {0, 0, 0.01 * 0.01 * f.c1_N_per_gray * f.c1_N_per_gray};
  s.force = f;
  return s;
}

TissueSensor::TissueSensor(const TissueOptions& options) : impl_(std::make_unique<Impl>(options)) {}
TissueSensor::~TissueSensor() = default;

FrameFormat TissueSensor::format() const {
  return {impl_->options.width, impl_->options.height, 1, 8};
}
double TissueSensor::rate_Hz() const {
  return impl_->options.rate_Hz;
}
std::optional<uint64_t> TissueSensor::frame_count() const {
  if (impl_->options.repeat == 0) return std::nullopt;
  return impl_->frames * impl_->options.repeat;
}

bool TissueSensor::next(Frame& frame) {
  if (impl_->past_end(next_sequence_)) return false;
  frame.reshape(format());
  frame.sequence = next_sequence_;
  frame.time_ns = std::llround(static_cast<double>(next_sequence_) / impl_->options.rate_Hz * 1e9);
  impl_->render(next_sequence_, frame);
  ++next_sequence_;
  return true;
}

bool TissueSensor::seek(uint64_t index) {
  if (impl_->past_end(index)) return false;
  next_sequence_ = index;
  return true;
}

std::optional<Frame> TissueSensor::own_background() const {
  Frame frame;
  frame.reshape(format());
  impl_->render(std::nullopt, frame);
  return frame;
}

double TissueSensor::block_force_N(uint64_t sequence) const {
  return impl_->force_N(sequence);
}

double TissueSensor::pressure_Pa(uint64_t sequence, double x_mm, double y_mm) const {
  const Impl::Seen now = impl_->seen(sequence);
  return now.force_N > 0 ? impl_->pressure_Pa(now, x_mm, y_mm) : 0;
}

HeldPose TissueSensor::held(uint64_t sequence) const {
  return impl_->held(sequence);
}

std::optional<Truth> TissueSensor::truth(uint64_t sequence) const {
  if (impl_->past_end(sequence)) return std::nullopt;
  Truth t;
  t.sequence = sequence;
  t.time_s = static_cast<double>(sequence) / impl_->options.rate_Hz;
  const Impl::Seen now = impl_->seen(sequence);
  t.contact = now.force_N > 0;
  t.depth_mm.assign(size_t{impl_->options.width} * impl_->options.height, 0.0f);
  if (!t.contact) return t;
  const uint32_t w = impl_->options.width, h = impl_->options.height;
  constexpr uint32_t kEvery = 4;
  double sum = 0, x_sum = 0, y_sum = 0;
  for (uint32_t y = kEvery / 2; y < h; y += kEvery)
    for (uint32_t x = kEvery / 2; x < w; x += kEvery) {
      const double p = impl_->pressure_Pa(now, impl_->x_mm(x), impl_->y_mm(y));
      sum += p;
      x_sum += p * x;
      y_sum += p * y;
    }
  t.force_N = 1e-6 * sum * std::pow(kEvery * impl_->pitch_mm, 2);
  if (sum > 0) {
    t.center_x_px = x_sum / sum;
    t.center_y_px = y_sum / sum;
  }
  t.radius_px = std::sqrt(double(w) * h / 3.14159265358979);
  t.contacts = {{t.force_N, t.center_x_px, t.center_y_px, t.radius_px}};
  return t;
}

}  // namespace palpate

#include "capture/synthetic.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "capture/synthetic_optics.h"
#include "capture/synthetic_scene.h"
#include "engine/error.h"

namespace palpate {
namespace {

void check(bool good, const std::string& wanted, double found, const std::string& remedy) {
  if (good) return;
  std::string number = std::to_string(found);
  if (number.find('.') != std::string::npos) number.erase(number.find_last_not_of('0') + 1);
  if (number.back() == '.') number.pop_back();
  throw Error(Failure::Input, "a synthetic sensor with " + wanted, number, remedy);
}

}  // namespace

void validate(const SyntheticOptions& o) {
  for (const uint32_t side : {o.width, o.height})
    check(side >= 1 && side <= kMaxSide_px, "sides of 1 to " + std::to_string(kMaxSide_px) + " px", side,
          "size=640x480 or size=1392x1042");
  check(o.bit_depth >= 8 && o.bit_depth <= 16, "8 to 16 bits", o.bit_depth, "bits=8 or bits=12");
  check(o.mode != SyntheticMode::Gel || o.bit_depth == 8, "8 bits in mode gel", o.bit_depth, "bits=8");
  check(o.rate_Hz >= 0.1 && o.rate_Hz <= 10000, "a rate of 0.1 to 10000 Hz", o.rate_Hz, "rate=30");
  check(o.falloff >= 0 && o.falloff < 1, "a falloff of 0 to 1", o.falloff, "falloff=0.015");
  check(o.force_N >= 0 && o.force_N <= 20, "a force of 0 to 20 N (0: the scene's own)", o.force_N,
        "force=1.5");
  check(o.indenter_radius_mm >= 0 && o.indenter_radius_mm <= 1000,
        "an indenter radius of 0 to 1000 mm (0: the scene's own)", o.indenter_radius_mm, "radius=8");
  check(o.pad_young_MPa > 0 && o.pad_young_MPa < 1e6, "a pad modulus > 0 MPa", o.pad_young_MPa, "0.2");
  check(o.pad_thickness_mm > 0 && o.pad_thickness_mm < 1e4, "a pad thickness > 0 mm", o.pad_thickness_mm,
        "6");
  check(o.friction > 0 && o.friction <= 10, "a friction coefficient of 0 to 10", o.friction, "0.5");
}

namespace {

/// A function of the distance from the contact's centre, sampled evenly in r.
struct RadialTable {
  float per_px = 1;  // samples in one pixel
  float last = 0;    // largest position that can be interpolated
  std::vector<float> values;

  float at(float position) const {
    position = std::min(position, last);
    const auto i = static_cast<int>(position);
    const float t = position - static_cast<float>(i);
    return values[i] + t * (values[i + 1] - values[i]);
  }
  static RadialTable make(double per_px, int count) {
    return {static_cast<float>(per_px), static_cast<float>(count - 2) + 0.999f, std::vector<float>(count)};
  }
};

}  // namespace

namespace {

/// The pad and what presses on it.
struct Mechanics {
  Scene scene;
  Layer layer;
  double radius_mm;        // of the indenter
  double force_scale = 1;  // on the script's forces
  double stiffness_N_per_mm = 0;

  explicit Mechanics(const SyntheticOptions& o)
      : scene(find_scene(o.scene)),
        layer({o.pad_young_MPa, 0.5}, o.pad_thickness_mm),
        radius_mm(o.indenter_radius_mm > 0 ? o.indenter_radius_mm : scene.indenter_radius_mm) {
    const double own_N = scene.largest_force_N();
    if (o.force_N > 0 && own_N > 0) force_scale = o.force_N / own_N;
    const double reference_N = own_N > 0 ? own_N * force_scale : 1;
    stiffness_N_per_mm =
        mindlin_stiffness_N_per_mm({o.pad_young_MPa, 0.5}, press(reference_N).summary().radius_mm);
  }

  LayerContact press(double force_N) const {
    return scene.flat ? layer.press_flat(force_N, radius_mm) : layer.press_sphere(force_N, radius_mm);
  }
};

}  // namespace

struct SyntheticSensor::Impl : Mechanics {
  SyntheticOptions options;
  double pitch_mm;
  double max_gray;
  std::vector<ScriptState> states;
  optics::NormalNoise normal;
  std::vector<float> stray;  // mean of the untouched image, fixed pattern included; gray (not Gel)
  std::vector<float> field;  // touch light relative to the centre (Waveguide)
  std::vector<float> stray_sd;

  explicit Impl(const SyntheticOptions& o)
      : Mechanics(o),
        options(o),
        pitch_mm(optics::pitch_mm(o)),
        max_gray(std::ldexp(1.0, static_cast<int>(o.bit_depth)) - 1),
        states(play(scene, o.rate_Hz, force_scale, stiffness_N_per_mm, o.friction)) {
    if (o.mode != SyntheticMode::Gel) make_maps();
  }

  uint64_t pattern_seed() const { return options.seed * 2 + 1; }
  double black() const { return optics::kBlack_gray * optics::scale(options.bit_depth); }

  /// Fixed pattern of one row, gray.
  void pattern(uint32_t channel, uint32_t y, std::vector<float>& row) const {
    normal.row(pattern_seed(), channel, y, options.width, row.data());
    const auto sd =
        static_cast<float>(options.noise ? optics::kPattern_gray * optics::scale(options.bit_depth) : 0);
    for (float& v : row) v *= sd;
  }

  double noise_sd(double gray) const {
    if (!options.noise) return 0;
    const double per_e = max_gray / optics::kFullWell_e;  // gray per electron
    return std::sqrt(per_e * per_e * optics::kReadNoise_e * optics::kReadNoise_e +
                     per_e * std::max(0.0, gray - black()));
  }

  void make_maps() {
    const uint32_t w = options.width, h = options.height;
    stray.resize(size_t{w} * h);
    field.resize(stray.size());
    stray_sd.resize(stray.size());
    const optics::Field light(options);
    std::vector<float> row(w);
    for (uint32_t y = 0; y < h; ++y) {
      pattern(0, y, row);
      const double y_mm = (y - (h - 1) / 2.0) * pitch_mm;
      for (uint32_t x = 0; x < w; ++x) {
        const double x_mm = (x - (w - 1) / 2.0) * pitch_mm;
        const size_t i = size_t{y} * w + x;
        const double gray = light.stray_gray(x_mm, y_mm);
        stray[i] = static_cast<float>(gray) + row[x];
        stray_sd[i] = static_cast<float>(noise_sd(gray));
        field[i] = static_cast<float>(light.touch(x_mm, y_mm));
      }
    }
  }

  const ScriptState& state(uint64_t sequence) const { return states[sequence % states.size()]; }
  bool past_end(uint64_t sequence) const {
    return options.repeat != 0 && sequence / states.size() >= options.repeat;
  }
  double center_x_px(const ScriptState& s) const {
    return (options.width - 1) / 2.0 + s.indenter.x_mm / pitch_mm;
  }
  double center_y_px(const ScriptState& s) const {
    return (options.height - 1) / 2.0 + s.indenter.y_mm / pitch_mm;
  }

  /// Touch light by distance: the pressure's mean over a pixel (the flat end's edge is broken by 0.1 mm),
  /// then the response.
  RadialTable touch_light(const LayerContact& contact) const {
    const double half_mm = std::max(pitch_mm / 2, scene.flat ? 0.1 : 0.0), per_px = 4,
                 step_mm = pitch_mm / per_px;
    const double reach_mm = contact.summary().radius_mm + half_mm;
    auto table = RadialTable::make(per_px, static_cast<int>(reach_mm / step_mm) + 4);
    const double scale = optics::scale(options.bit_depth), limit = optics::kResponseLimit_gray * scale;
    for (size_t i = 0; i < table.values.size(); ++i) {
      const double r = static_cast<double>(i) * step_mm, out = r + half_mm, in = std::max(0.0, r - half_mm);
      const double force_N = contact.force_within_N(out) - (in > 0 ? contact.force_within_N(in) : 0);
      double gray = optics::kGrayPerMPa * scale * force_N / (std::numbers::pi * (out * out - in * in));
      if (options.response == SyntheticResponse::Saturating) gray = limit * (1 - std::exp(-gray / limit));
      table.values[i] = static_cast<float>(std::max(0.0, gray));
    }
    table.values.end()[-1] = table.values.end()[-2] = 0;
    return table;
  }

  /// Depth by distance over the whole frame, mm.
  RadialTable depth(const LayerContact& contact, double per_px) const {
    const double reach_px = 2.0 * std::hypot(options.width, options.height) + 2;
    // Nothing is drawn beyond the layer's reach of 16 thicknesses.
    const double reach = std::min(reach_px, 16 * options.pad_thickness_mm / pitch_mm + 2);
    auto table = RadialTable::make(per_px, static_cast<int>(reach * per_px) + 3);
    for (size_t i = 0; i < table.values.size(); ++i)
      table.values[i] = static_cast<float>(contact.deflection_mm(static_cast<double>(i) * pitch_mm / per_px));
    return table;
  }

  /// d(depth)/dr / r by distance, 1/mm: times the offset from the centre it is the gradient.
  RadialTable slope_over_r(const LayerContact& contact) const {
    const double per_px = 2;
    auto table = depth(contact, per_px);
    const double step_mm = pitch_mm / per_px, a = contact.summary().radius_mm;
    std::vector<double> slope(table.values.size());
    for (size_t i = 1; i < slope.size(); ++i) {
      const double r = static_cast<double>(i) * step_mm, h = std::min(0.1 * step_mm, r / 2);
      // Differences within one side of the rim: a flat end's surface has an edge there.
      const double low = r > a ? std::max(r - h, a) : r - h, high = r <= a ? std::min(r + h, a) : r + h;
      slope[i] = (contact.deflection_mm(high) - contact.deflection_mm(low)) / (high - low) / r;
    }
    slope[0] = slope.size() > 1 ? slope[1] : 0;
    std::copy(slope.begin(), slope.end(), table.values.begin());
    return table;
  }

  template <class Pixel>
  void store(const float* mean, const float* sd, const float* noise, Pixel* out) const {
    const auto top = static_cast<float>(max_gray);
    const uint32_t w = options.width;
    for (uint32_t x = 0; x < w; ++x) {
      const float v = std::min(std::max(mean[x] + sd[x] * noise[x], 0.0f), top);
      out[x] =
          static_cast<Pixel>(static_cast<int>(v + 0.5f));  // NOLINT(bugprone-incorrect-roundings): v >= 0
    }
  }
  void store(const float* mean, const float* sd, const float* noise, uint8_t* row) const {
    if (options.bit_depth <= 8)
      store<uint8_t>(mean, sd, noise, row);
    else
      store<uint16_t>(mean, sd, noise, reinterpret_cast<uint16_t*>(row));
  }
  void make_noise(uint64_t sequence, uint32_t channel, uint32_t y, std::vector<float>& noise) const {
    if (options.noise)
      normal.row(options.seed * 2, sequence, (uint64_t{channel} << 32) + y, options.width, noise.data());
  }

  void render_gray(uint64_t sequence, Frame& frame) const {
    const ScriptState& s = state(sequence);
    const uint32_t w = options.width, h = options.height;
    const bool touching = s.indenter.force_N > 0, lambert = options.mode == SyntheticMode::Lambert;
    const LayerContact contact = press(s.indenter.force_N);
    RadialTable light;
    if (touching) light = lambert ? facing_light(contact) : touch_light(contact);
    const auto cx = static_cast<float>(center_x_px(s));
    const double cy = center_y_px(s),
                 reach = touching ? (static_cast<double>(light.values.size()) - 1) / light.per_px : -1;
    const auto begin = static_cast<uint32_t>(std::clamp(std::floor(cx - reach), 0.0, double(w)));
    const auto end = static_cast<uint32_t>(std::clamp(std::ceil(cx + reach) + 1, 0.0, double(w)));
    const double per_e = max_gray / optics::kFullWell_e;
    const auto read_variance =
        static_cast<float>(options.noise ? per_e * per_e * optics::kReadNoise_e * optics::kReadNoise_e : 0);
    const auto shot = static_cast<float>(options.noise ? per_e : 0);
    const auto dark = static_cast<float>(black());
    std::vector<float> noise(w), mean(w), sd(w);
    for (uint32_t y = 0; y < h; ++y) {
      make_noise(sequence, 0, y, noise);
      const size_t i = size_t{y} * w;
      const auto dy = static_cast<float>(y - cy);
      if (!touching || std::abs(dy) > reach || begin >= end) {
        store(stray.data() + i, stray_sd.data() + i, noise.data(), frame.row(0, y));
        continue;
      }
      std::copy_n(stray.data() + i, w, mean.data());
      std::copy_n(stray_sd.data() + i, w, sd.data());
      for (uint32_t x = begin; x < end; ++x) {
        const float dx = static_cast<float>(x) - cx;
        const float touch = light.at(std::sqrt(dx * dx + dy * dy) * light.per_px);
        mean[x] += lambert ? touch : touch * field[i + x];
      }
      for (uint32_t x = begin; x < end; ++x)
        sd[x] = std::sqrt(read_variance + shot * std::max(0.0f, mean[x] - dark));
      store(mean.data(), sd.data(), noise.data(), frame.row(0, y));
    }
  }

  /// Lambert: facing_gray * n_z inside the contact, nothing outside; the rim pixel is blended by its share
  /// inside.
  RadialTable facing_light(const LayerContact& contact) const {
    const double per_px = 4, a_px = contact.summary().radius_mm / pitch_mm;
    auto table = RadialTable::make(per_px, static_cast<int>((a_px + 1) * per_px) + 4);
    for (size_t i = 0; i < table.values.size(); ++i) {
      const double r_px = static_cast<double>(i) / per_px,
                   slope = scene.flat ? 0 : std::min(r_px, a_px) * pitch_mm / radius_mm;
      const double inside = std::clamp(a_px - r_px + 0.5, 0.0, 1.0);
      table.values[i] = static_cast<float>(inside * optics::kFacing_gray * optics::scale(options.bit_depth) /
                                           std::sqrt(1 + slope * slope));
    }
    return table;
  }

  void render_gel(uint64_t sequence, Frame& frame) const {
    const ScriptState& s = state(sequence);
    const uint32_t w = options.width, h = options.height;
    const bool touching = s.indenter.force_N > 0;
    RadialTable table;
    if (touching) table = slope_over_r(press(s.indenter.force_N));
    const auto cx = static_cast<float>(center_x_px(s)), pitch = static_cast<float>(pitch_mm);
    const double cy = center_y_px(s);
    const double per_e = max_gray / optics::kFullWell_e;
    const auto read_variance =
        static_cast<float>(options.noise ? per_e * per_e * optics::kReadNoise_e * optics::kReadNoise_e : 0);
    const auto shot = static_cast<float>(options.noise ? per_e : 0);
    const auto dark = static_cast<float>(optics::kBlack_gray);
    std::vector<float> nx(w, 0.0f), ny(w, 0.0f), nz(w, 1.0f), mean(w), sd(w), noise(w), fixed(w);
    for (uint32_t y = 0; y < h; ++y) {
      const auto dy = static_cast<float>(y - cy);
      if (touching) {
        for (uint32_t x = 0; x < w; ++x) {
          const float dx = static_cast<float>(x) - cx;
          const float slope = table.at(std::sqrt(dx * dx + dy * dy) * table.per_px) * pitch;
          nx[x] = slope * dx;
          ny[x] = slope * dy;
        }
        for (uint32_t x = 0; x < w; ++x) {
          nz[x] = 1 / std::sqrt(1 + nx[x] * nx[x] + ny[x] * ny[x]);
          nx[x] *= nz[x];
          ny[x] *= nz[x];
        }
      }
      const double v = h > 1 ? 2.0 * y / (h - 1) - 1 : 0;
      for (uint32_t c = 0; c < 3; ++c) {
        const auto light = optics::gel_light(static_cast<int>(c));
        const auto lx = static_cast<float>(light[0]), ly = static_cast<float>(light[1]),
                   lz = static_cast<float>(light[2]);
        const double left = optics::gel_brightness(static_cast<int>(c), w > 1 ? -1 : 0, v) * max_gray;
        const double right = optics::gel_brightness(static_cast<int>(c), w > 1 ? 1 : 0, v) * max_gray;
        const auto start = static_cast<float>(left),
                   step = static_cast<float>(w > 1 ? (right - left) / (w - 1) : 0);
        pattern(c, y, fixed);
        make_noise(sequence, c, y, noise);
        for (uint32_t x = 0; x < w; ++x) {
          const float power = start + step * static_cast<float>(x);
          const float light_gray = power * std::max(0.0f, nx[x] * lx + ny[x] * ly + nz[x] * lz);
          mean[x] = dark + fixed[x] + light_gray;
          sd[x] = std::sqrt(read_variance + shot * light_gray);
        }
        store(mean.data(), sd.data(), noise.data(), frame.row(c, y));
      }
    }
  }

  FrameFormat format() const {
    return {options.width, options.height, options.mode == SyntheticMode::Gel ? 3u : 1u, options.bit_depth};
  }
};

SyntheticSensor::SyntheticSensor(const SyntheticOptions& options)
    : impl_((validate(options), std::make_unique<Impl>(options))) {}
SyntheticSensor::~SyntheticSensor() = default;

FrameFormat SyntheticSensor::format() const {
  return impl_->format();
}
double SyntheticSensor::rate_Hz() const {
  return impl_->options.rate_Hz;
}
std::optional<uint64_t> SyntheticSensor::frame_count() const {
  if (impl_->options.repeat == 0) return std::nullopt;
  return impl_->states.size() * impl_->options.repeat;
}

bool SyntheticSensor::next(Frame& frame) {
  return render(next_sequence_, frame) && ++next_sequence_;
}

bool SyntheticSensor::render(uint64_t sequence, Frame& frame) const {
  if (impl_->past_end(sequence)) return false;
  frame.reshape(impl_->format());
  frame.sequence = sequence;
  frame.time_ns = std::llround(static_cast<double>(sequence) / impl_->options.rate_Hz * 1e9);
  if (impl_->options.mode == SyntheticMode::Gel)
    impl_->render_gel(sequence, frame);
  else
    impl_->render_gray(sequence, frame);
  return true;
}

std::optional<Frame> SyntheticSensor::own_background() const {
  Frame frame;
  frame.reshape(impl_->format());
  const uint32_t w = impl_->options.width, h = impl_->options.height;
  const std::vector<float> none(w, 0.0f);
  std::vector<float> mean(w), fixed(w);
  for (uint32_t c = 0; c < frame.format.channels; ++c) {
    for (uint32_t y = 0; y < h; ++y) {
      if (impl_->options.mode == SyntheticMode::Gel) {
        impl_->pattern(c, y, fixed);
        const int channel = static_cast<int>(c);
        const double v = h > 1 ? 2.0 * y / (h - 1) - 1 : 0,
                     facing = optics::gel_light(channel)[2] * impl_->max_gray;
        for (uint32_t x = 0; x < w; ++x) {
          const double u = w > 1 ? 2.0 * x / (w - 1) - 1 : 0;
          mean[x] = fixed[x] +
                    static_cast<float>(optics::kBlack_gray + optics::gel_brightness(channel, u, v) * facing);
        }
      } else {
        std::copy_n(impl_->stray.data() + size_t{y} * w, w, mean.data());
      }
      impl_->store(mean.data(), none.data(), none.data(), frame.row(c, y));
    }
  }
  return frame;
}

LayerContact SyntheticSensor::contact(uint64_t sequence) const {
  return impl_->press(impl_->state(sequence).indenter.force_N);
}

std::optional<Truth> SyntheticSensor::truth(uint64_t sequence) const {
  if (impl_->past_end(sequence)) return std::nullopt;
  const ScriptState& s = impl_->state(sequence);
  const LayerContact contact = impl_->press(s.indenter.force_N);
  Truth t;
  t.sequence = sequence;
  t.time_s = static_cast<double>(sequence) / impl_->options.rate_Hz;
  t.contact = s.indenter.force_N > 0;
  t.force_N = s.indenter.force_N;
  t.shear_x_N = s.shear_x_N;
  t.shear_y_N = s.shear_y_N;
  t.slipping = s.slipping;
  t.center_x_px = impl_->center_x_px(s);
  t.center_y_px = impl_->center_y_px(s);
  t.radius_px = t.contact ? contact.summary().radius_mm / impl_->pitch_mm : 0;
  t.indentation_mm = t.contact ? contact.summary().indentation_mm : 0;
  const uint32_t w = impl_->options.width, h = impl_->options.height;
  t.depth_mm.assign(size_t{w} * h, 0.0f);
  if (!t.contact) return t;
  const RadialTable table = impl_->depth(contact, 4);
  const auto cx = static_cast<float>(t.center_x_px);
  for (uint32_t y = 0; y < h; ++y) {
    const auto dy = static_cast<float>(y - t.center_y_px);
    for (uint32_t x = 0; x < w; ++x) {
      const float dx = static_cast<float>(x) - cx;
      t.depth_mm[size_t{y} * w + x] = table.at(std::sqrt(dx * dx + dy * dy) * table.per_px);
    }
  }
  return t;
}

double SyntheticSensor::noise_sd_gray(double gray) const {
  return impl_->noise_sd(gray);
}

double shear_stiffness_N_per_mm(const SyntheticOptions& options) {
  return Mechanics(options).stiffness_N_per_mm;
}

double gray_per_MPa(const SyntheticOptions& options) {
  return optics::kGrayPerMPa * optics::scale(options.bit_depth);
}

}  // namespace palpate

#include "capture/synthetic/synthetic.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "capture/synthetic/contact.h"
#include "capture/synthetic/optics.h"
#include "capture/synthetic/skin.h"
#include "palpate/error.h"

namespace palpate {
namespace {

/// One indenter while it touches.
struct Touching {
  const ScriptState* state;
  LayerContact contact;
  double x_px, y_px;  // of its centre
  double radius_mm;
};

/// Displacement of the skin under one contact, by distance from its centre.
struct SkinField {
  RadialTable pulled, turned;
  float x_px, y_px;            // of the contact's centre
  float pull_x_px, pull_y_px;  // of the core
  float turn_rad, radius_px;
};

}  // namespace

struct SyntheticSensor::Impl : PressedPad {
  SyntheticOptions options;
  double pitch_mm;
  double max_gray;
  optics::NormalNoise normal;
  std::vector<float> stray;  // mean of the untouched image, fixed pattern included; gray (not Gel)
  std::vector<float> field;  // touch light relative to the centre (Waveguide)
  std::vector<float> stray_sd;
  std::optional<SkinMap> skin;
  std::vector<float> fixed;  // the fixed pattern alone, where the skin has one (not Gel)
  double stiffness_N_per_mm;

  explicit Impl(const SyntheticOptions& o)
      : PressedPad(o),
        options(o),
        pitch_mm(optics::pitch_mm(o)),
        max_gray(std::ldexp(1.0, static_cast<int>(o.bit_depth)) - 1),
        stiffness_N_per_mm(script_rules(o).stiffness_N_per_mm) {
    if (o.skin != SyntheticSkin::None) skin.emplace(o);
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
    if (skin) fixed.resize(stray.size());
    std::vector<float> row(w);
    for (uint32_t y = 0; y < h; ++y) {
      pattern(0, y, row);
      if (skin) std::copy(row.begin(), row.end(), fixed.begin() + static_cast<std::ptrdiff_t>(size_t{y} * w));
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

  bool past_end(uint64_t sequence) const {
    return options.repeat != 0 && sequence / frames() >= options.repeat;
  }
  std::vector<Touching> touching(uint64_t sequence) const {
    std::vector<Touching> all;
    for (size_t i = 0; i < indenters(); ++i) {
      const ScriptState& s = state(i, sequence);
      if (s.indenter.force_N <= 0) continue;
      const LayerContact contact = press(s.indenter.force_N);
      all.push_back({&s, contact, (options.width - 1) / 2.0 + s.indenter.x_mm / pitch_mm,
                     (options.height - 1) / 2.0 + s.indenter.y_mm / pitch_mm, contact.summary().radius_mm});
    }
    return all;
  }

  SkinField skin_field(const SkinMove& m) const {
    const double per_px = 4, a = m.radius_mm, h = options.pad_thickness_mm, step_mm = pitch_mm / per_px;
    const int count = static_cast<int>((a + 5 * h) / step_mm) + 3;  // there the taper is below 4e-4
    SkinField f{RadialTable::make(per_px, count),
                RadialTable::make(per_px, count),
                static_cast<float>(m.x_px),
                static_cast<float>(m.y_px),
                static_cast<float>(m.pull_x_mm / pitch_mm),
                static_cast<float>(m.pull_y_mm / pitch_mm),
                static_cast<float>(m.turn_rad),
                static_cast<float>(a / pitch_mm)};
    for (int i = 0; i + 2 < count; ++i) {
      f.pulled.values[i] = static_cast<float>(pulled_fraction(i * step_mm, a, a * m.stick_share, h));
      f.turned.values[i] = static_cast<float>(turned_fraction(i * step_mm, a, h));
    }
    return f;
  }
  std::vector<SkinField> skin_fields(const std::vector<Touching>& all) const {
    std::vector<SkinField> fields;
    for (const Touching& t : all)
      fields.push_back(
          skin_field({t.x_px, t.y_px, t.radius_mm, t.state->shear_x_N / stiffness_N_per_mm,
                      t.state->shear_y_N / stiffness_N_per_mm, t.state->turn_rad, t.state->stick_share}));
    return fields;
  }

  /// Tangential displacement, px, of the skin that is now at x, y px.
  static std::array<float, 2> shift_px(const std::vector<SkinField>& fields, float x, float y) {
    float u = 0, v = 0;
    for (const SkinField& f : fields) {
      const float dx = x - f.x_px, dy = y - f.y_px, r = std::sqrt(dx * dx + dy * dy);
      const float pulled = f.pulled.at(r * f.pulled.per_px);
      u += f.pull_x_px * pulled;
      v += f.pull_y_px * pulled;
      if (f.turn_rad == 0 || r == 0) continue;
      const float turned = f.turn_rad * f.radius_px * f.turned.at(r * f.turned.per_px) / r;
      u -= turned * dy;
      v += turned * dx;
    }
    return {u, v};
  }

  /// Light of the skin's pattern along one row, over that of bare skin.
  void skin_row(const std::vector<SkinField>& fields, uint32_t y, std::vector<float>& row) const {
    const auto fy = static_cast<float>(y);
    for (uint32_t x = 0; x < options.width; ++x) {
      const auto fx = static_cast<float>(x);
      const auto [u, v] = shift_px(fields, fx, fy);
      row[x] = skin->at(fx - u, fy - v);
    }
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
    const uint32_t w = options.width, h = options.height;
    const bool lambert = options.mode == SyntheticMode::Lambert;
    struct Lit {
      RadialTable light;
      float x_px;
      double y_px, reach_px;
      uint32_t begin, end;
    };
    const std::vector<Touching> contacts = touching(sequence);
    const double drift = 1 + options.drift_per_min * static_cast<double>(sequence) / options.rate_Hz / 60;
    std::vector<Lit> lit;
    for (const Touching& t : contacts) {
      Lit l;
      l.light = lambert ? facing_light(t.contact) : touch_light(t.contact, t.state->light * drift);
      l.x_px = static_cast<float>(t.x_px);
      l.y_px = t.y_px;
      l.reach_px = (static_cast<double>(l.light.values.size()) - 1) / l.light.per_px;
      l.begin = static_cast<uint32_t>(std::clamp(std::floor(l.x_px - l.reach_px), 0.0, double(w)));
      l.end = static_cast<uint32_t>(std::clamp(std::ceil(l.x_px + l.reach_px) + 1, 0.0, double(w)));
      if (l.begin < l.end) lit.push_back(std::move(l));
    }
    const std::vector<SkinField> fields = skin ? skin_fields(contacts) : std::vector<SkinField>{};
    const double per_e = max_gray / optics::kFullWell_e;
    const auto read_variance =
        static_cast<float>(options.noise ? per_e * per_e * optics::kReadNoise_e * optics::kReadNoise_e : 0);
    const auto shot = static_cast<float>(options.noise ? per_e : 0);
    const auto dark = static_cast<float>(black());
    std::vector<float> noise(w), mean(w), sd(w), light(w);
    const auto set_noise = [&](uint32_t begin, uint32_t end) {
      for (uint32_t x = begin; x < end; ++x)
        sd[x] = std::sqrt(read_variance + shot * std::max(0.0f, mean[x] - dark));
    };
    for (uint32_t y = 0; y < h; ++y) {
      make_noise(sequence, 0, y, noise);
      const size_t i = size_t{y} * w;
      const auto crosses = [y](const Lit& l) {
        return std::abs(static_cast<float>(y - l.y_px)) <= l.reach_px;
      };
      if (!skin && std::none_of(lit.begin(), lit.end(), crosses)) {
        store(stray.data() + i, stray_sd.data() + i, noise.data(), frame.row(0, y));
        continue;
      }
      std::copy_n(stray.data() + i, w, mean.data());
      std::copy_n(stray_sd.data() + i, w, sd.data());
      for (const Lit& l : lit) {
        if (!crosses(l)) continue;
        const auto dy = static_cast<float>(y - l.y_px);
        for (uint32_t x = l.begin; x < l.end; ++x) {
          const float touch = l.light.at(static_cast<float>(x) - l.x_px, dy);
          mean[x] += lambert ? touch : touch * field[i + x];
        }
      }
      if (skin) {
        skin_row(fields, y, light);
        for (uint32_t x = 0; x < w; ++x) {
          const float floor = dark + fixed[i + x];
          mean[x] = floor + (mean[x] - floor) * light[x];
        }
        set_noise(0, w);
      } else {
        for (const Lit& l : lit)
          if (crosses(l)) set_noise(l.begin, l.end);
      }
      store(mean.data(), sd.data(), noise.data(), frame.row(0, y));
    }
  }

  void render_gel(uint64_t sequence, Frame& frame) const {
    const std::vector<Touching> contacts = touching(sequence);
    std::vector<RadialTable> tables;
    tables.reserve(contacts.size());
    for (const Touching& t : contacts) tables.push_back(slope_over_r(t.contact, t.x_px, t.y_px));
    const auto pitch = static_cast<float>(pitch_mm);
    const uint32_t w = options.width;
    const auto slopes = [&](uint32_t y, std::vector<float>& nx, std::vector<float>& ny) {
      for (size_t k = 0; k < contacts.size(); ++k) {
        const auto cx = static_cast<float>(contacts[k].x_px), dy = static_cast<float>(y - contacts[k].y_px);
        for (uint32_t x = 0; x < w; ++x) {
          const float dx = static_cast<float>(x) - cx;
          const float slope = tables[k].at(dx, dy) * pitch;
          nx[x] = (k > 0 ? nx[x] : 0) + slope * dx;
          ny[x] = (k > 0 ? ny[x] : 0) + slope * dy;
        }
      }
    };
    render_gel(sequence, frame, !contacts.empty(), slopes,
               skin ? skin_fields(contacts) : std::vector<SkinField>{});
  }

  /// `slopes` fills those of a row, to the right and down; not asked where nothing is pressed.
  template <class Slopes>
  void render_gel(uint64_t sequence, Frame& frame, bool pressed, const Slopes& slopes,
                  const std::vector<SkinField>& fields) const {
    const uint32_t w = options.width, h = options.height;
    const double per_e = max_gray / optics::kFullWell_e;
    const auto read_variance =
        static_cast<float>(options.noise ? per_e * per_e * optics::kReadNoise_e * optics::kReadNoise_e : 0);
    const auto shot = static_cast<float>(options.noise ? per_e : 0);
    const auto dark = static_cast<float>(optics::kBlack_gray);
    std::vector<float> nx(w, 0.0f), ny(w, 0.0f), nz(w, 1.0f), mean(w), sd(w), noise(w), still(w),
        light(w, 1.0f);
    for (uint32_t y = 0; y < h; ++y) {
      if (pressed) {
        slopes(y, nx, ny);
        for (uint32_t x = 0; x < w; ++x) {
          nz[x] = 1 / std::sqrt(1 + nx[x] * nx[x] + ny[x] * ny[x]);
          nx[x] *= nz[x];
          ny[x] *= nz[x];
        }
      }
      if (skin) skin_row(fields, y, light);
      const double v = h > 1 ? 2.0 * y / (h - 1) - 1 : 0;
      for (uint32_t c = 0; c < 3; ++c) {
        const auto from = optics::gel_light(static_cast<int>(c));
        const auto lx = static_cast<float>(from[0]), ly = static_cast<float>(from[1]),
                   lz = static_cast<float>(from[2]);
        const double left = optics::gel_brightness(static_cast<int>(c), w > 1 ? -1 : 0, v) * max_gray;
        const double right = optics::gel_brightness(static_cast<int>(c), w > 1 ? 1 : 0, v) * max_gray;
        const auto start = static_cast<float>(left),
                   step = static_cast<float>(w > 1 ? (right - left) / (w - 1) : 0);
        pattern(c, y, still);
        make_noise(sequence, c, y, noise);
        for (uint32_t x = 0; x < w; ++x) {
          const float power = start + step * static_cast<float>(x);
          const float light_gray = power * std::max(0.0f, nx[x] * lx + ny[x] * ly + nz[x] * lz) * light[x];
          mean[x] = dark + still[x] + light_gray;
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
  return impl_->frames() * impl_->options.repeat;
}

bool SyntheticSensor::next(Frame& frame) {
  return render(next_sequence_, frame) && ++next_sequence_;
}

bool SyntheticSensor::render(uint64_t sequence, Frame& frame) const {
  if (impl_->past_end(sequence)) return false;
  frame.reshape(impl_->format());
  frame.sequence = sequence;
  frame.time_ns = std::llround(static_cast<double>(sequence) / impl_->options.rate_Hz * 1e9 +
                               1e6 * skew_ms(impl_->options));
  if (impl_->options.mode == SyntheticMode::Gel)
    impl_->render_gel(sequence, frame);
  else
    impl_->render_gray(sequence, frame);
  return true;
}

void SyntheticSensor::render_relief(uint64_t sequence, std::span<const float> slopes, const SkinMove& moved,
                                    Frame& frame) const {
  frame.reshape(impl_->format());
  frame.sequence = sequence;
  frame.time_ns = std::llround(static_cast<double>(sequence) / impl_->options.rate_Hz * 1e9);
  const uint32_t w = impl_->options.width;
  const auto row_of = [&](uint32_t y, std::vector<float>& nx, std::vector<float>& ny) {
    const float* from = slopes.data() + size_t{2} * y * w;
    for (uint32_t x = 0; x < w; ++x) {
      nx[x] = from[2 * x];
      ny[x] = from[2 * x + 1];
    }
  };
  std::vector<SkinField> fields;
  if (impl_->skin && moved.radius_mm > 0) fields.push_back(impl_->skin_field(moved));
  impl_->render_gel(sequence, frame, !slopes.empty(), row_of, fields);
}

std::optional<Frame> SyntheticSensor::own_background() const {
  Frame frame;
  frame.reshape(impl_->format());
  const uint32_t w = impl_->options.width, h = impl_->options.height;
  const std::vector<float> none(w, 0.0f);
  std::vector<float> mean(w), still(w), light(w, 1.0f);
  for (uint32_t c = 0; c < frame.format.channels; ++c) {
    for (uint32_t y = 0; y < h; ++y) {
      if (impl_->skin) impl_->skin_row({}, y, light);
      if (impl_->options.mode == SyntheticMode::Gel) {
        impl_->pattern(c, y, still);
        const int channel = static_cast<int>(c);
        const double v = h > 1 ? 2.0 * y / (h - 1) - 1 : 0,
                     facing = optics::gel_light(channel)[2] * impl_->max_gray;
        for (uint32_t x = 0; x < w; ++x) {
          const double u = w > 1 ? 2.0 * x / (w - 1) - 1 : 0;
          mean[x] =
              still[x] + static_cast<float>(optics::kBlack_gray + optics::gel_brightness(channel, u, v) *
                                                                      facing * double{light[x]});
        }
      } else {
        const size_t i = size_t{y} * w;
        std::copy_n(impl_->stray.data() + i, w, mean.data());
        for (uint32_t x = 0; impl_->skin && x < w; ++x) {
          const float floor = static_cast<float>(impl_->black()) + impl_->fixed[i + x];
          mean[x] = floor + (mean[x] - floor) * light[x];
        }
      }
      impl_->store(mean.data(), none.data(), none.data(), frame.row(c, y));
    }
  }
  return frame;
}

LayerContact SyntheticSensor::contact(uint64_t sequence) const {
  return impl_->press(impl_->state(0, sequence).indenter.force_N);
}

std::array<double, 2> SyntheticSensor::skin_shift_px(uint64_t sequence, double x_px, double y_px) const {
  const std::vector<SkinField> fields = impl_->skin_fields(impl_->touching(sequence));
  double u = 0, v = 0;
  // The fields say where the skin at a place came from; the way there is much longer than their scale.
  for (int i = 0; i < 50; ++i) {
    const auto shift = Impl::shift_px(fields, static_cast<float>(x_px + u), static_cast<float>(y_px + v));
    u = double{shift[0]};
    v = double{shift[1]};
  }
  return {u, v};
}

std::optional<Truth> SyntheticSensor::truth(uint64_t sequence) const {
  if (impl_->past_end(sequence)) return std::nullopt;
  const std::vector<Touching> contacts = impl_->touching(sequence);
  const ScriptState& first = impl_->state(0, sequence);
  const uint32_t w = impl_->options.width, h = impl_->options.height;
  Truth t;
  t.sequence = sequence;
  t.time_s = static_cast<double>(sequence) / impl_->options.rate_Hz + 1e-3 * skew_ms(impl_->options);
  t.contact = !contacts.empty();
  t.center_x_px = (w - 1) / 2.0 + first.indenter.x_mm / impl_->pitch_mm;
  t.center_y_px = (h - 1) / 2.0 + first.indenter.y_mm / impl_->pitch_mm;
  double x = 0, y = 0, turn = 0, squares = 0;
  for (const Touching& c : contacts) {
    const ScriptState& s = *c.state;
    const double force_N = s.indenter.force_N, radius_px = c.radius_mm / impl_->pitch_mm;
    t.contacts.push_back({force_N, c.x_px, c.y_px, radius_px});
    t.force_N += force_N;
    t.shear_x_N += s.shear_x_N;
    t.shear_y_N += s.shear_y_N;
    t.slipping |= s.slipping;
    t.stick_share = std::min(t.stick_share, s.stick_share);
    t.indentation_mm = std::max(t.indentation_mm, c.contact.summary().indentation_mm);
    x += force_N * c.x_px;
    y += force_N * c.y_px;
    turn += force_N * s.turn_rad;
    squares += radius_px * radius_px;
  }
  t.depth_mm.assign(size_t{w} * h, 0.0f);
  if (!t.contact) return t;
  t.torsion_rad = turn / t.force_N;
  t.radius_px = std::sqrt(squares);
  if (contacts.size() == 1) {
    t.center_x_px = contacts.front().x_px;
    t.center_y_px = contacts.front().y_px;
    t.radius_px = t.contacts.front().radius_px;
  } else {
    t.center_x_px = x / t.force_N;
    t.center_y_px = y / t.force_N;
  }
  for (const Touching& c : contacts) {
    const RadialTable table = impl_->depth(c.contact, c.x_px, c.y_px, 4);
    const auto cx = static_cast<float>(c.x_px);
    for (uint32_t row = 0; row < h; ++row) {
      const auto dy = static_cast<float>(row - c.y_px);
      for (uint32_t column = 0; column < w; ++column)
        t.depth_mm[size_t{row} * w + column] += table.at(static_cast<float>(column) - cx, dy);
    }
  }
  for (const float depth_mm : t.depth_mm) t.volume_mm3 += std::max(0.0, double{depth_mm});
  t.volume_mm3 *= impl_->pitch_mm * impl_->pitch_mm;
  return t;
}

double SyntheticSensor::noise_sd_gray(double gray) const {
  return impl_->noise_sd(gray);
}

double shear_stiffness_N_per_mm(const SyntheticOptions& options) {
  return script_rules(options).stiffness_N_per_mm;
}

double gray_per_MPa(const SyntheticOptions& options) {
  return optics::kGrayPerMPa * optics::scale(options.bit_depth);
}

}  // namespace palpate

#include "capture/synthetic/object.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <mutex>
#include <numbers>

#include "capture/synthetic/object_mesh.h"
#include "capture/synthetic/object_path.h"
#include "capture/synthetic/optics.h"
#include "capture/synthetic/skin.h"
#include "capture/synthetic/synthetic.h"

namespace palpate {

Sensor object_sensor(const ObjectOptions& options) {
  return synthetic_sensor(options.camera);
}

namespace {

/// Shortens a load to its limit; whether it had to be.
bool limit(double& x, double& y, double most) {
  const double size = std::hypot(x, y);
  if (size <= most) return false;
  x *= most / size;
  y *= most / size;
  return true;
}

}  // namespace

struct ObjectSensor::Impl {
  /// The contact of one frame, and what it has done to the skin.
  struct ObjectState {
    double x_mm = 0, y_mm = 0;  // of the area's centre
    double radius_mm = 0;       // 0: no contact
    double depth_mm = 0;        // the largest
    double pull_x_mm = 0, pull_y_mm = 0, turn_rad = 0;
    double stick_share = 1;
    bool slips = false;
    bool touches() const { return radius_mm > 0; }
  };

  ObjectOptions options;
  SyntheticSensor camera;
  ObjectMesh mesh;
  ObjectPath path;
  uint64_t frames;
  double pitch_mm;
  mutable std::once_flag once;
  mutable std::vector<ObjectState> states;
  mutable size_t first_touch = 0;

  explicit Impl(const ObjectOptions& o)
      : options(o),
        camera(o.camera),
        mesh(o.file.empty() ? shape_mesh(o.shape) : read_object(o.file, o.pitch_mm)),
        path(o, mesh.half_height_mm),
        frames(static_cast<uint64_t>(std::max(1.0, std::round(path.duration_s() * o.camera.rate_Hz)))),
        pitch_mm(optics::pitch_mm(o.camera)) {}

  bool past_end(uint64_t sequence) const {
    return options.camera.repeat != 0 && sequence / frames >= options.camera.repeat;
  }
  double time_s(uint64_t sequence) const {
    return static_cast<double>(sequence % frames) / options.camera.rate_Hz;
  }

  /// Of the gel's surface at a time, at each half pixel.
  std::vector<float> half_pixels(double time_s) const {
    const PixelGrid grid{2 * options.camera.width, 2 * options.camera.height, pitch_mm / 2};
    std::vector<float> depth = depth_of(mesh, path.at(time_s), grid);
    if (options.creep > 0) {
      constexpr int kParts = 6;  // of the late share, each as likely
      for (float& d : depth) d *= static_cast<float>(1 - options.creep);
      for (int k = 0; k < kParts; ++k) {
        const double late_s = -options.creep_s * std::log(1 - (k + 0.5) / kParts);
        if (late_s > time_s) continue;
        const std::vector<float> before = depth_of(mesh, path.at(time_s - late_s), grid);
        for (size_t i = 0; i < depth.size(); ++i)
          depth[i] += static_cast<float>(options.creep / kParts) * before[i];
      }
    }
    smooth(depth, grid.width, grid.height, options.smooth_mm / grid.pitch_mm);
    return depth;
  }

  /// Calls set(pixel, its four half pixels: above left, above right, below left, below right).
  template <class Set>
  void each_pixel(const std::vector<float>& half, const Set& set) const {
    const uint32_t w = options.camera.width, h = options.camera.height;
    for (uint32_t y = 0; y < h; ++y)
      for (uint32_t x = 0; x < w; ++x) {
        const float* at = half.data() + size_t{4} * y * w + 2 * x;
        set(size_t{y} * w + x, at[0], at[1], at[2 * w], at[2 * w + 1]);
      }
  }

  /// Empty: nothing is pressed.
  std::vector<float> slopes(uint64_t sequence) const {
    const std::vector<float> half = half_pixels(time_s(sequence));
    if (std::ranges::none_of(half, [](float d) { return d > 0; })) return {};
    std::vector<float> out(half.size() / 2);
    const auto part = static_cast<float>(1 / pitch_mm);  // mean of two differences over half a pixel
    each_pixel(half, [&](size_t i, float a, float b, float c, float d) {
      out[2 * i] = (b - a + d - c) * part;
      out[2 * i + 1] = (c - a + d - b) * part;
    });
    return out;
  }

  ObjectState contact(const RigidMotion& motion) const {
    constexpr uint32_t kWidth = 160;
    const SyntheticOptions& c = options.camera;
    const PixelGrid grid{kWidth, std::max(kWidth * c.height / c.width, 1u), optics::kFieldWidth_mm / kWidth};
    const std::vector<float> depth = depth_of(mesh, motion, grid);
    ObjectState s;
    double count = 0;
    for (size_t i = 0; i < depth.size(); ++i) {
      if (depth[i] <= 0) continue;
      ++count;
      const size_t column = i % grid.width, row = i / grid.width;
      s.x_mm += (static_cast<double>(column) - (grid.width - 1) / 2.0) * grid.pitch_mm;
      s.y_mm += (static_cast<double>(row) - (grid.height - 1) / 2.0) * grid.pitch_mm;
      s.depth_mm = std::max(s.depth_mm, double{depth[i]});
    }
    if (count == 0) return s;
    s.x_mm /= count;
    s.y_mm /= count;
    s.radius_mm = std::sqrt(count / std::numbers::pi) * grid.pitch_mm;
    return s;
  }

  /// A half space of incompressible rubber under a contact of radius a holds mu P against Mindlin's
  /// stiffness, both of which grow with a: the skin's way is mu times the depth.
  void find_states() const {
    states.resize(frames);
    RigidMotion before;
    for (size_t k = 0; k < frames; ++k) {
      const RigidMotion now = path.at(static_cast<double>(k) / options.camera.rate_Hz);
      ObjectState& s = states[k];
      s = contact(now);
      if (s.touches() && k > 0 && states[k - 1].touches()) {
        const ObjectState& last = states[k - 1];
        const RigidMotion step = now * before.inverse();
        const Eigen::Vector3d at(s.x_mm, s.y_mm, s.depth_mm), way = step * at - at;
        s.pull_x_mm = last.pull_x_mm + way[0];
        s.pull_y_mm = last.pull_y_mm + way[1];
        s.turn_rad = last.turn_rad + turn_vector(step.turn)[2];
        const double most_mm = options.camera.friction * s.depth_mm;
        s.slips = limit(s.pull_x_mm, s.pull_y_mm, most_mm);
        s.stick_share = s.slips ? 0 : std::cbrt(1 - std::hypot(s.pull_x_mm, s.pull_y_mm) / most_mm);
        // That of a turned sphere (turn_limit_rad) at Hertz's force.
        const double most_rad = 9 * std::numbers::pi / 256 * 16 / 3 * most_mm / s.radius_mm;
        s.turn_rad = std::clamp(s.turn_rad, -most_rad, most_rad);
      }
      if (s.touches() && !states[first_touch].touches()) first_touch = k;
      before = now;
    }
  }
  const ObjectState& state(uint64_t sequence) const {
    std::call_once(once, [this] { find_states(); });
    return states[sequence % frames];
  }

  double column_of(double x_mm) const { return (options.camera.width - 1) / 2.0 + x_mm / pitch_mm; }
  double row_of(double y_mm) const { return (options.camera.height - 1) / 2.0 + y_mm / pitch_mm; }

  SkinMove skin(uint64_t sequence) const {
    if (options.camera.skin == SyntheticSkin::None) return {};
    const ObjectState& s = state(sequence);
    return {column_of(s.x_mm), row_of(s.y_mm), s.radius_mm,  s.pull_x_mm,
            s.pull_y_mm,       s.turn_rad,     s.stick_share};
  }

  Truth truth(uint64_t sequence) const {
    const ObjectState& s = state(sequence);
    Truth t;
    t.sequence = sequence;
    t.time_s = static_cast<double>(sequence) / options.camera.rate_Hz;
    t.contact = s.touches();
    t.depth_mm.resize(size_t{options.camera.width} * options.camera.height);
    each_pixel(half_pixels(time_s(sequence)),
               [&](size_t i, float a, float b, float c, float d) { t.depth_mm[i] = (a + b + c + d) / 4; });
    for (const float d : t.depth_mm) t.volume_mm3 += double{d} * pitch_mm * pitch_mm;
    t.center_x_px = column_of(s.x_mm);
    t.center_y_px = row_of(s.y_mm);
    if (!t.contact) return t;
    const double young_MPa = options.camera.pad_young_MPa, stiffness = 16.0 / 9 * young_MPa * s.radius_mm;
    t.radius_px = s.radius_mm / pitch_mm;
    t.indentation_mm = s.depth_mm;
    t.force_N = stiffness * s.depth_mm;
    t.shear_x_N = stiffness * s.pull_x_mm;
    t.shear_y_N = stiffness * s.pull_y_mm;
    t.slipping = s.slips;
    t.stick_share = s.stick_share;
    t.torsion_rad = s.turn_rad;
    t.contacts = {{t.force_N, t.center_x_px, t.center_y_px, t.radius_px}};
    const RigidMotion moved = path.at(time_s(sequence)) *
                              path.at(static_cast<double>(first_touch) / options.camera.rate_Hz).inverse();
    const Eigen::Vector3d turn = turn_vector(moved.turn);
    t.motion =
        TrueMotion{{moved.shift_mm[0], moved.shift_mm[1], moved.shift_mm[2]}, {turn[0], turn[1], turn[2]}};
    return t;
  }
};

ObjectSensor::ObjectSensor(const ObjectOptions& options) : impl_(std::make_unique<Impl>(options)) {}
ObjectSensor::~ObjectSensor() = default;

FrameFormat ObjectSensor::format() const {
  return impl_->camera.format();
}
double ObjectSensor::rate_Hz() const {
  return impl_->options.camera.rate_Hz;
}
std::optional<uint64_t> ObjectSensor::frame_count() const {
  const uint32_t repeat = impl_->options.camera.repeat;
  return repeat == 0 ? std::nullopt : std::optional(impl_->frames * repeat);
}

bool ObjectSensor::next(Frame& frame) {
  if (impl_->past_end(next_sequence_)) return false;
  const uint64_t k = next_sequence_++;
  impl_->camera.render_relief(k, impl_->slopes(k), impl_->skin(k), frame);
  return true;
}

bool ObjectSensor::seek(uint64_t index) {
  if (impl_->past_end(index)) return false;
  next_sequence_ = index;
  return true;
}

std::optional<Frame> ObjectSensor::own_background() const {
  return impl_->camera.own_background();
}

std::optional<Truth> ObjectSensor::truth(uint64_t sequence) const {
  if (impl_->past_end(sequence)) return std::nullopt;
  return impl_->truth(sequence);
}

}  // namespace palpate

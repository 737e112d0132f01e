#include "engine/motion/registration.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "engine/base/nth_value.h"
#include "engine/base/simd.h"
#include "engine/motion/residual_noise.h"

namespace palpate {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Level = ContactSurface::Level;

constexpr size_t kFewest = 60;                               // pixels that a motion takes
constexpr double kTukey = 4.685;                             // loses a twentieth under normal noise
constexpr double kFineStep_px = 0.01, kCoarseStep_px = 0.1;  // steps below these end a search
constexpr double kLeastResidual_px = 0.005;  // what sampling leaves on a surface without noise

/// The motion about the middle of the key frame's contact: q = turn (p - middle) + middle + shift.
struct Guess {
  Vector3d middle;
  Matrix3d turn;
  Vector3d shift;

  Guess(const RigidMotion& motion, const Vector3d& about)
      : middle(about), turn(motion.turn), shift(motion * about - about) {}
  RigidMotion motion() const { return {turn, middle + shift - turn * middle}; }
  /// A small motion before this one, seen at the middle.
  void add(const Vector6d& step) {
    shift += turn * step.head<3>();
    turn = turn * turn_of(step.tail<3>());
  }
};

/// What Tukey's weights are about. By squares nothing is a stranger yet: relief on flat ground fits almost
/// everywhere, and by the median its edges would be left out before they fit.
enum class Spread { Squares, Median };

constexpr size_t kLanes = 8;  // that sums are split into, whatever the processor's are

/// The pixels inside, each divided by its standard error (up to a common factor). Those that cannot be
/// compared have an inverse variance of 0.
struct Equations {
  size_t count = 0;
  std::array<std::vector<float>, 6> row;         ///< of a step, by the mean of both slopes
  std::array<std::vector<float>, 6> difference;  ///< of the two slopes' rows
  std::vector<float> residual, inverse_variance;
  std::vector<float> compared;  ///< the residuals of those that can be, in a row
  double scale = 0;             ///< standard deviation of the residual, by the median or by squares
  double mean_precision = 0;

  void compare(const Level& key, const Level& now, const Guess& guess, Spread by = Spread::Median);
  double residual_mm() const { return scale / std::sqrt(mean_precision); }

 private:
  std::vector<float> sizes_;
};

/// Each pixel by itself: its depth at the key frame's place (Catmull-Rom), slopes there (bilinear).
struct Compare {
  const float *key_depth, *key_slope_x, *key_slope_y, *key_variance;
  const float *depth, *slope_x, *slope_y, *variance, *column, *line;
  const uint32_t* inside;
  std::array<float*, 6> row, difference;
  float *residual, *inverse_variance;
  size_t count;
  int key_width, key_height;
  float pitch, per_pitch;
  std::array<float, 9> back;    ///< turns, rows
  std::array<float, 3> origin;  ///< of the first pixel, from the guess's middle and shift, mm
  std::array<float, 3> middle;  ///< of the guess, from the key frame's first pixel, mm; z is a depth

  PALPATE_INLINE void run() const {
    PALPATE_INDEPENDENT
    for (size_t i = 0; i < count; ++i) one(i);
  }

 private:
  PALPATE_INLINE static std::array<float, 4> cubic(float t) {
    return {t * (-0.5f + t * (1 - 0.5f * t)), 1 + t * t * (-2.5f + 1.5f * t), t * (0.5f + t * (2 - 1.5f * t)),
            t * t * (-0.5f + 0.5f * t)};
  }

  PALPATE_INLINE void one(size_t i) const {
    const auto at = static_cast<int>(inside[i]);
    const float qx = origin[0] + column[i] * pitch, qy = origin[1] + line[i] * pitch,
                qz = origin[2] + depth[at];
    const float x = back[0] * qx + back[1] * qy + back[2] * qz,
                y = back[3] * qx + back[4] * qy + back[5] * qz,
                z = back[6] * qx + back[7] * qy + back[8] * qz;
    const float px = (x + middle[0]) * per_pitch, py = (y + middle[1]) * per_pitch;
    // Places beyond the map are read within it, and left out.
    const auto most_x = static_cast<float>(key_width - 3), most_y = static_cast<float>(key_height - 3);
    const float held_x = std::min(std::max(px, 1.0f), most_x), held_y = std::min(std::max(py, 1.0f), most_y);
    const auto left = static_cast<int>(held_x), top = static_cast<int>(held_y);
    const float u = held_x - static_cast<float>(left), v = held_y - static_cast<float>(top);
    const int here = top * key_width + left;
    const float there_variance = key_variance[here + (u >= 0.5f ? 1 : 0) + (v >= 0.5f ? key_width : 0)];
    const std::array<float, 4> across = cubic(u), down = cubic(v);
    float there = 0;
    for (int k = 0; k < 4; ++k) {
      const float* d = key_depth + (here + (k - 1) * key_width - 1);
      there += down[static_cast<size_t>(k)] *
               (across[0] * d[0] + across[1] * d[1] + across[2] * d[2] + across[3] * d[3]);
    }
    const auto linear = [&](const float* of) {
      return (1 - v) * ((1 - u) * of[here] + u * of[here + 1]) +
             v * ((1 - u) * of[here + key_width] + u * of[here + key_width + 1]);
    };
    const float sx = slope_x[at], sy = slope_y[at];
    const float tz = back[6] * sx + back[7] * sy - back[8];
    const float steep = -1 / std::min(tz, -0.05f);  // what is seen from the side is left out
    const float tx = (back[0] * sx + back[1] * sy - back[2]) * steep,
                ty = (back[3] * sx + back[4] * sy - back[5]) * steep;
    const float lx = linear(key_slope_x), ly = linear(key_slope_y);
    const bool good =
        (px >= 1) & (py >= 1) & (px < most_x) & (py < most_y) & (there_variance > 0) & (tz <= -0.05f);
    const float precision = good ? 1 / (std::max(there_variance, 0.0f) + variance[at]) : 0;
    const float scaled = std::sqrt(precision);
    residual[i] = (there - middle[2] - z) * scaled;
    inverse_variance[i] = precision;
    // Both normals have -1 as their third component.
    const auto store = [&](const std::array<float*, 6>& to, float nx, float ny, float nz) {
      to[0][i] = -nx * scaled;
      to[1][i] = -ny * scaled;
      to[2][i] = -nz * scaled;
      to[3][i] = -(y * nz - z * ny) * scaled;
      to[4][i] = -(z * nx - x * nz) * scaled;
      to[5][i] = -(x * ny - y * nx) * scaled;
    };
    store(row, (lx + tx) / 2, (ly + ty) / 2, -1);
    store(difference, lx - tx, ly - ty, 0);
  }
};

void Equations::compare(const Level& key, const Level& now, const Guess& guess, Spread by) {
  count = now.inside.size();
  // Sums take whole lanes.
  const auto end_lanes = [this](std::vector<float>& values) {
    values.resize((count + kLanes - 1) / kLanes * kLanes);
    std::fill(values.begin() + static_cast<std::ptrdiff_t>(count), values.end(), 0.0f);
  };
  for (auto* of : {&row, &difference})
    for (std::vector<float>& values : *of) end_lanes(values);
  end_lanes(residual);
  end_lanes(inverse_variance);
  Compare work{.key_depth = key.depth.data(),
               .key_slope_x = key.slope_x.data(),
               .key_slope_y = key.slope_y.data(),
               .key_variance = key.inside_variance.data(),
               .depth = now.depth.data(),
               .slope_x = now.slope_x.data(),
               .slope_y = now.slope_y.data(),
               .variance = now.variance.data(),
               .column = now.column.data(),
               .line = now.row.data(),
               .inside = now.inside.data(),
               .row = {},
               .difference = {},
               .residual = residual.data(),
               .inverse_variance = inverse_variance.data(),
               .count = count,
               .key_width = static_cast<int>(key.width),
               .key_height = static_cast<int>(key.height),
               .pitch = static_cast<float>(now.pitch_mm),
               .per_pitch = static_cast<float>(1 / key.pitch_mm),
               .back = {},
               .origin = {},
               .middle = {}};
  const Matrix3d back = guess.turn.transpose();
  const Vector3d corner(now.left_mm, now.top_mm, 0), moved = guess.middle + guess.shift;
  const Vector3d key_corner(key.left_mm, key.top_mm, 0);
  for (size_t k = 0; k < 6; ++k) {
    work.row[k] = row[k].data();
    work.difference[k] = difference[k].data();
  }
  for (size_t k = 0; k < 9; ++k)
    work.back[k] =
        static_cast<float>(back(static_cast<Eigen::Index>(k / 3), static_cast<Eigen::Index>(k % 3)));
  for (size_t k = 0; k < 3; ++k) {
    const auto at = static_cast<Eigen::Index>(k);
    work.origin[k] = static_cast<float>(corner[at] - moved[at]);
    work.middle[k] = static_cast<float>(guess.middle[at] - key_corner[at]);
  }
  run_widest(work);
  compared.clear();
  double squares = 0, precisions = 0;
  for (size_t i = 0; i < count; ++i) {
    if (inverse_variance[i] <= 0) continue;
    compared.push_back(residual[i]);
    squares += double{residual[i]} * double{residual[i]};
    precisions += double{inverse_variance[i]};
  }
  if (compared.empty()) return;
  const auto pixels = static_cast<double>(compared.size());
  mean_precision = precisions / pixels;
  const double least = kLeastResidual_px * now.pitch_mm * std::sqrt(mean_precision);
  if (by == Spread::Median) {
    sizes_.resize(compared.size());
    std::transform(compared.begin(), compared.end(), sizes_.begin(), [](float r) { return std::abs(r); });
    scale = 1.4826 * double{nth_value(sizes_, sizes_.size() / 2)};
  } else {
    scale = std::sqrt(squares / pixels);
  }
  scale = std::max(scale, least);
}

/// Mean of the residuals' squares, none above Tukey's bound.
double loss(const std::vector<float>& residuals, double scale) {
  const double most = std::pow(kTukey * scale, 2);
  double sum = 0;
  for (const float r : residuals) sum += std::min(double{r} * double{r}, most);
  return sum / static_cast<double>(residuals.size());
}

struct Sums {
  Matrix6d square = Matrix6d::Zero();      ///< of the rows, weighted
  Matrix6d difference = Matrix6d::Zero();  ///< of the differences
  Vector6d gradient = Vector6d::Zero();
  double weight = 0;
};

constexpr size_t kProducts = 21;  // of six and six

/// Weighted products of rows, by lanes and in parts, so that their order is the same on every processor.
template <bool Judged>
struct AddUp {
  std::array<const float*, 6> row, difference;
  const float *residual, *inverse_variance;
  size_t first, end;  ///< multiples of kLanes
  float per_bound;    ///< 1 / Tukey's
  float* sums;  ///< kLanes each of: 21 products, 6 of the gradient, the weight; judged: 21 of differences

  PALPATE_INLINE void run() const {
    for (size_t at = first; at < end; at += kLanes) PALPATE_INDEPENDENT
    for (size_t lane = 0; lane < kLanes; ++lane) one(at + lane, lane);
  }

 private:
  PALPATE_INLINE void one(size_t i, size_t lane) const {
    const float r = residual[i] * per_bound, rest = std::max(1 - r * r, 0.0f);
    const float weight = rest * rest;
    // Judged: the slope of the score.
    const float used = Judged ? rest * (1 - 5 * r * r) : weight;
    for (size_t a = 0, k = 0; a < 6; ++a) {
      const float mine = row[a][i], scaled = used * mine;
      [[maybe_unused]] const float other = Judged ? used * difference[a][i] : 0;
      for (size_t b = 0; b <= a; ++b, ++k) {
        sums[k * kLanes + lane] += scaled * row[b][i];
        if constexpr (Judged) sums[(kProducts + 7 + k) * kLanes + lane] += other * difference[b][i];
      }
      sums[(kProducts + a) * kLanes + lane] += weight * mine * residual[i];
    }
    sums[(kProducts + 6) * kLanes + lane] += used * inverse_variance[i];
  }
};

/// Judged: rows weighed by the score's slope instead of its weight, and the differences.
template <bool Judged>
Sums add_up(const Equations& all) {
  constexpr size_t kPart = 256 * kLanes;  // of single precision, before it goes into double
  std::array<double, 2 * kProducts + 7> whole{};
  std::array<float, whole.size() * kLanes> part;
  for (size_t first = 0; first < all.residual.size(); first += kPart) {
    part.fill(0);
    AddUp<Judged> work{.row = {},
                       .difference = {},
                       .residual = all.residual.data(),
                       .inverse_variance = all.inverse_variance.data(),
                       .first = first,
                       .end = std::min(first + kPart, all.residual.size()),
                       .per_bound = static_cast<float>(1 / (kTukey * all.scale)),
                       .sums = part.data()};
    for (size_t k = 0; k < 6; ++k) {
      work.row[k] = all.row[k].data();
      work.difference[k] = all.difference[k].data();
    }
    run_widest(work);
    for (size_t k = 0; k < part.size(); ++k) whole[k / kLanes] += double{part[k]};
  }
  Sums sums;
  for (int a = 0, k = 0; a < 6; ++a) {
    sums.gradient[a] = whole[kProducts + static_cast<size_t>(a)];
    for (int b = 0; b <= a; ++b, ++k) {
      sums.square(a, b) = sums.square(b, a) = whole[static_cast<size_t>(k)];
      sums.difference(a, b) = sums.difference(b, a) = whole[kProducts + 7 + static_cast<size_t>(k)];
    }
  }
  sums.weight = whole[kProducts + 6];
  return sums;
}

/// One level's steps; returns whether the last one was next to nothing.
bool search(const Level& key, const Level& now, double radius_mm, Guess& guess, Equations& all, int& steps,
            const RegistrationOptions& options, Spread by, double enough_px) {
  for (int step = 0; step < options.most_steps; ++step) {
    ++steps;
    all.compare(key, now, guess, by);
    if (all.compared.size() < kFewest) return false;
    const Sums sums = add_up<false>(all);
    // Far from the truth the two frames' slopes have nothing in common: only the floor bounds a step.
    const Solution solution = solve({.information = sums.square,
                                     .noise = Matrix6d::Zero(),
                                     .weight = sums.weight,
                                     .pixels = double(all.compared.size())},
                                    guess.middle, radius_mm, options.freedom);
    Vector6d move = -(solution.inverse * sums.gradient);
    const double size_mm = move.head<3>().norm() + move.tail<3>().norm() * radius_mm;
    const double most_mm = 4 * now.pitch_mm;
    if (size_mm > most_mm) move *= most_mm / size_mm;
    guess.add(move);
    if (size_mm < enough_px * now.pitch_mm) return true;
  }
  return false;
}

/// The best of three searches: on the last of the coarse levels alone, and on all of them with and without
/// strangers. A dome slides along itself where a level is too coarse for its texture.
struct Levels {
  size_t end, first;  ///< from the coarsest, end - 1, to `first`
};
Guess coarse_guess(const ContactSurface& key, const ContactSurface& now, Levels levels, double radius_mm,
                   const Guess& start, Equations& all, int& steps, const RegistrationOptions& options) {
  if (levels.first >= levels.end) return start;
  std::array<Guess, 3> guesses = {start, start, start};
  std::array<std::vector<float>, 3> residuals;
  double scale = INFINITY;
  for (size_t k = 0; k < 3; ++k) {
    for (size_t level = k == 0 ? levels.first + 1 : levels.end; level-- > levels.first;)
      search(key.levels()[level], now.levels()[level], radius_mm, guesses[k], all, steps, options,
             k == 1 ? Spread::Squares : Spread::Median, kCoarseStep_px);
    if (k == 1)
      all.compare(key.levels()[levels.first], now.levels()[levels.first], guesses[k], Spread::Median);
    if (all.compared.size() < kFewest) continue;
    if (k == 0 && all.residual_mm() <= options.enough_residual_mm) return guesses[k];
    residuals[k] = all.compared;
    scale = std::min(scale, all.scale);
  }
  size_t best = 0;
  double least = INFINITY;
  for (size_t k = 0; k < 3; ++k) {
    const double left = residuals[k].empty() ? INFINITY : loss(residuals[k], scale);
    if (left < least) best = k;
    least = std::min(left, least);
  }
  return guesses[best];
}

/// What the pad's own errors add to the scores' noise: fields of several reaches that share its slopes' error
/// and do not move, seen from an object that has gone by way_px.
void add_pad(ScoreNoise& noise, double slope_sd, double way_px, double pitch_mm, double precision) {
  constexpr size_t kFirst = 2;  // reaches of 3 px and more; a frame's filter leaves none of shorter ones
  for (size_t k = kFirst; k < ScoreNoise::kReaches; ++k) {
    const double reach = ScoreNoise::reach_px(k), depth_sd_mm = slope_sd * reach * pitch_mm;
    const double changed = 2 * (1 - std::exp(-way_px * way_px / (2 * reach * reach)));
    noise.variance[k] += changed * depth_sd_mm * depth_sd_mm * precision / (ScoreNoise::kReaches - kFirst);
  }
}

/// Registration::disagreement. Noise of shorter reaches makes slopes that differ, too, and is left out.
double slopes_disagree(const Sums& sums, const ScoreNoise& noise, double least_slope) {
  const double apart = sums.difference.diagonal().head<2>().sum() / 2;
  const double both = 2 * sums.square.diagonal().head<2>().sum() + apart;  // of each frame's, summed
  if (both < 2 * std::pow(2 * least_slope, 2) * sums.weight) return 0;
  double all = 0, wide = 0;
  for (size_t k = 0; k < ScoreNoise::kReaches; ++k) {
    const double slope = noise.variance[k] / std::pow(std::max(ScoreNoise::reach_px(k), 1.0), 2);
    all += slope;
    if (k >= 2) wide += slope;
  }
  return all > 0 ? std::min(2 * apart / both, 1.0) * wide / all : 0;
}

/// What is left over, and what it makes of the motion.
void judge(const Equations& all, const Level& now, double radius_mm, const Guess& guess,
           const RegistrationOptions& options, Registration& out) {
  const Sums sums = add_up<true>(all);
  FreedomOptions freedom = options.freedom;
  freedom.least_slope = std::max(freedom.least_slope, options.pad_slope_sd);
  const Solution solution = solve({.information = sums.square - sums.difference / 4,
                                   .noise = sums.difference / 2,
                                   .weight = sums.weight,
                                   .pixels = double(all.compared.size())},
                                  guess.middle, radius_mm, freedom);
  ScoreField field{.width = now.width, .height = now.height, .pixel = {}, .row = {}, .score = {}};
  for (size_t i = 0; i < all.count; ++i) {
    if (all.inverse_variance[i] <= 0) continue;
    const double r = double{all.residual[i]} / (kTukey * all.scale), rest = std::max(1 - r * r, 0.0);
    if (rest <= 0) continue;
    field.pixel.push_back(now.inside[i]);
    std::array<float, 6>& row = field.row.emplace_back();
    for (size_t k = 0; k < 6; ++k) row[k] = all.row[k][i];
    field.score.push_back(static_cast<float>(rest * rest * double{all.residual[i]}));
  }
  out.fitting = static_cast<double>(field.pixel.size()) / static_cast<double>(all.compared.size());
  out.residual_mm = all.residual_mm();
  ScoreNoise noise = score_noise(field, radius_mm / now.pitch_mm);
  out.disagreement = slopes_disagree(sums, noise, freedom.least_slope);
  if (options.pad_slope_sd > 0) {
    const double way_mm = std::hypot(guess.shift.norm(), turn_vector(guess.turn).norm() * radius_mm / 2);
    add_pad(noise, options.pad_slope_sd, way_mm / now.pitch_mm, now.pitch_mm, all.mean_precision);
  }
  const Matrix6d turned = carried_by({guess.turn, Vector3d::Zero()});
  const Matrix6d spread = turned * solution.inverse;
  out.covariance = spread * gradient_covariance(field, noise) * spread.transpose();
  out.freedom = solution.freedom.after(out.motion);
}

}  // namespace

Registration register_surface(const ContactSurface& key, const ContactSurface& now, const RigidMotion& start,
                              const RegistrationOptions& options) {
  Registration out;
  const size_t levels = std::min(key.levels().size(), now.levels().size());
  if (std::min(key.count(), now.count()) < kFewest) return out;
  const size_t finest = std::min<size_t>(options.finest_level, levels - 1);
  const double radius_mm = std::max(key.radius_mm(), key.levels().front().pitch_mm);
  Guess guess(start, key.centroid_mm());
  Equations all;
  guess = coarse_guess(key, now, {levels, finest + 1}, radius_mm, guess, all, out.steps, options);
  const Level &there = key.levels()[finest], &here = now.levels()[finest];
  out.converged =
      search(there, here, radius_mm, guess, all, out.steps, options, Spread::Median, kFineStep_px);
  // A last step of next to nothing leaves the residuals as they are.
  if (!out.converged) all.compare(there, here, guess);
  if (all.compared.size() < kFewest) return out;
  out.found = true;
  out.motion = guess.motion();
  out.at_mm = guess.middle + guess.shift;
  out.overlap = static_cast<double>(all.compared.size()) /
                static_cast<double>(std::min(there.inside.size(), here.inside.size()));
  judge(all, here, radius_mm, guess, options, out);
  // What slides along itself only nearly fits again after a step or two.
  constexpr double kLargeTurn = 0.002;
  const RigidMotion least = out.freedom.least_turn(out.motion);
  if (turn_vector(least.turn * out.motion.turn.transpose()).norm() > kLargeTurn) {
    guess = Guess(least, key.centroid_mm());
    out.converged =
        search(there, here, radius_mm, guess, all, out.steps, options, Spread::Median, kFineStep_px);
    if (!out.converged) all.compare(there, here, guess);
    if (all.compared.size() < kFewest) return {};
    out.motion = guess.motion();
    out.at_mm = guess.middle + guess.shift;
    judge(all, here, radius_mm, guess, options, out);
  }
  out.motion = out.freedom.least_turn(out.motion);
  const Vector3d at = out.motion * key.centroid_mm();
  const Matrix6d moved = seen_at(out.at_mm, at);
  out.covariance = moved * out.covariance * moved.transpose();
  out.freedom = out.freedom.at(at);
  out.at_mm = at;
  out.covariance(2, 2) += std::pow(key.level_sd_mm(), 2) + std::pow(now.level_sd_mm(), 2);
  return out;
}

}  // namespace palpate

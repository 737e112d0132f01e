#include "engine/motion/registration.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <vector>

#include "engine/base/nth_value.h"
#include "engine/motion/residual_noise.h"

namespace palpate {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Level = ContactSurface::Level;
using Row = std::array<float, 6>;

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

/// Depth of the key frame at a place in pixels (Catmull-Rom), and its slopes (bilinear).
struct Sample {
  double depth, slope_x, slope_y, variance;
};
std::optional<Sample> sample(const Level& level, double x, double y) {
  const double left = std::floor(x), top = std::floor(y);
  if (!(left >= 1 && top >= 1 && left + 3 <= level.width && top + 3 <= level.height)) return std::nullopt;
  const double u = x - left, v = y - top;
  const size_t at = static_cast<size_t>(top) * level.width + static_cast<size_t>(left);
  const size_t nearest = at + (u < 0.5 ? 0 : 1) + (v < 0.5 ? 0 : level.width);
  if (level.mask[nearest] == 0) return std::nullopt;
  const auto cubic = [](double t) {
    return std::array<double, 4>{t * (-0.5 + t * (1 - 0.5 * t)), 1 + t * t * (-2.5 + 1.5 * t),
                                 t * (0.5 + t * (2 - 1.5 * t)), t * t * (-0.5 + 0.5 * t)};
  };
  const std::array<double, 4> across = cubic(u), down = cubic(v);
  double depth = 0;
  const float* row = level.depth.data() + (at - level.width - 1);
  for (size_t k = 0; k < 4; ++k, row += level.width)
    depth += down[k] * (across[0] * double{row[0]} + across[1] * double{row[1]} + across[2] * double{row[2]} +
                        across[3] * double{row[3]});
  const auto linear = [&](const std::vector<float>& of) {
    const float* p = of.data() + at;
    return (1 - v) * ((1 - u) * double{p[0]} + u * double{p[1]}) +
           v * ((1 - u) * double{p[level.width]} + u * double{p[level.width + 1]});
  };
  return Sample{depth, linear(level.slope_x), linear(level.slope_y), double{level.variance[nearest]}};
}

Row row_of(const Vector3d& normal, const Vector3d& place, double scale) {
  const Vector3d turning = cross(place) * normal;
  Row row{};
  for (int k = 0; k < 3; ++k) {
    row[static_cast<size_t>(k)] = static_cast<float>(-normal[k] * scale);
    row[static_cast<size_t>(k) + 3] = static_cast<float>(-turning[k] * scale);
  }
  return row;
}

/// What Tukey's weights are about. By squares nothing is a stranger yet: relief on flat ground fits almost
/// everywhere, and by the median its edges would be left out before they fit.
enum class Spread { Squares, Median };

/// All pixels that can be compared, each divided by its standard error (up to a common factor).
struct Equations {
  std::vector<uint32_t> pixel;
  std::vector<Row> row;         ///< of a step, by the mean of both slopes
  std::vector<Row> difference;  ///< of the two slopes' rows
  std::vector<float> residual;
  std::vector<float> inverse_variance;
  double scale = 0;  ///< standard deviation of the residual, by the median or by squares
  double mean_precision = 0;

  void compare(const Level& key, const Level& now, const Guess& guess, Spread by = Spread::Median);
  double residual_mm() const { return scale / std::sqrt(mean_precision); }

 private:
  std::vector<float> sizes_;
};

void Equations::compare(const Level& key, const Level& now, const Guess& guess, Spread by) {
  pixel.clear();
  row.clear();
  difference.clear();
  residual.clear();
  inverse_variance.clear();
  const Matrix3d back = guess.turn.transpose();
  for (const uint32_t at : now.inside) {
    const uint32_t line = at / now.width, column = at % now.width;
    const Vector3d q(now.left_mm + column * now.pitch_mm, now.top_mm + line * now.pitch_mm,
                     double{now.depth[at]});
    const Vector3d place = back * (q - guess.middle - guess.shift);
    const Vector3d p = place + guess.middle;
    const auto there = sample(key, (p[0] - key.left_mm) / key.pitch_mm, (p[1] - key.top_mm) / key.pitch_mm);
    if (!there) continue;
    Vector3d turned = back * Vector3d(double{now.slope_x[at]}, double{now.slope_y[at]}, -1);
    if (turned[2] > -0.05) continue;  // seen from the side
    turned /= -turned[2];
    const Vector3d normal(there->slope_x, there->slope_y, -1);
    const double precision = 1 / (there->variance + double{now.variance[at]});
    const double scaled = std::sqrt(precision);
    pixel.push_back(at);
    row.push_back(row_of((normal + turned) / 2, place, scaled));
    difference.push_back(row_of(normal - turned, place, scaled));
    residual.push_back(static_cast<float>((there->depth - p[2]) * scaled));
    inverse_variance.push_back(static_cast<float>(precision));
  }
  if (residual.empty()) return;
  const auto count = static_cast<double>(residual.size());
  double squares = 0;
  mean_precision = 0;
  for (const float p : inverse_variance) mean_precision += double{p} / count;
  for (const float r : residual) squares += double{r} * double{r} / count;
  sizes_.resize(residual.size());
  std::transform(residual.begin(), residual.end(), sizes_.begin(), [](float r) { return std::abs(r); });
  const double least = kLeastResidual_px * now.pitch_mm * std::sqrt(mean_precision);
  scale = by == Spread::Median ? 1.4826 * double{nth_value(sizes_, sizes_.size() / 2)} : std::sqrt(squares);
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

/// `slope_of_score`: weighs rows by the score's slope instead of its weight.
Sums add_up(const Equations& all, bool slope_of_score) {
  Sums sums;
  double square[21] = {}, difference[21] = {}, gradient[6] = {};
  for (size_t i = 0; i < all.pixel.size(); ++i) {
    const double r = double{all.residual[i]} / (kTukey * all.scale), rest = 1 - r * r;
    if (rest <= 0) continue;
    const double weight = rest * rest, used = slope_of_score ? rest * (1 - 5 * r * r) : weight;
    const Row &row = all.row[i], &other = all.difference[i];
    for (size_t a = 0, k = 0; a < 6; ++a) {
      gradient[a] += weight * double{row[a]} * double{all.residual[i]};
      for (size_t b = 0; b <= a; ++b, ++k) {
        square[k] += used * double{row[a]} * double{row[b]};
        difference[k] += used * double{other[a]} * double{other[b]};
      }
    }
    sums.weight += used * double{all.inverse_variance[i]};
  }
  for (int a = 0, k = 0; a < 6; ++a) {
    sums.gradient[a] = gradient[a];
    for (int b = 0; b <= a; ++b, ++k) {
      sums.square(a, b) = sums.square(b, a) = square[k];
      sums.difference(a, b) = sums.difference(b, a) = difference[k];
    }
  }
  return sums;
}

/// One level's steps; returns whether the last one was next to nothing.
bool search(const Level& key, const Level& now, double radius_mm, Guess& guess, Equations& all, int& steps,
            const RegistrationOptions& options, Spread by, double enough_px) {
  for (int step = 0; step < options.most_steps; ++step) {
    ++steps;
    all.compare(key, now, guess, by);
    if (all.pixel.size() < kFewest) return false;
    const Sums sums = add_up(all, false);
    // Far from the truth the two frames' slopes have nothing in common: only the floor bounds a step.
    const Solution solution = solve({.information = sums.square,
                                     .noise = Matrix6d::Zero(),
                                     .weight = sums.weight,
                                     .pixels = double(all.pixel.size())},
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
    if (all.pixel.size() < kFewest) continue;
    if (k == 0 && all.residual_mm() <= options.enough_residual_mm) return guesses[k];
    residuals[k] = all.residual;
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

/// What is left over, and what it makes of the motion.
void judge(const Equations& all, const Level& now, double radius_mm, const Guess& guess,
           const RegistrationOptions& options, Registration& out) {
  const Sums sums = add_up(all, true);
  const Solution solution = solve({.information = sums.square - sums.difference / 4,
                                   .noise = sums.difference / 2,
                                   .weight = sums.weight,
                                   .pixels = double(all.pixel.size())},
                                  guess.middle, radius_mm, options.freedom);
  ScoreField field{.width = now.width, .height = now.height, .pixel = {}, .row = {}, .score = {}};
  for (size_t i = 0; i < all.pixel.size(); ++i) {
    const double r = double{all.residual[i]} / (kTukey * all.scale), rest = std::max(1 - r * r, 0.0);
    if (rest <= 0) continue;
    field.pixel.push_back(all.pixel[i]);
    field.row.push_back(all.row[i]);
    field.score.push_back(static_cast<float>(rest * rest * double{all.residual[i]}));
  }
  out.fitting = static_cast<double>(field.pixel.size()) / static_cast<double>(all.pixel.size());
  out.residual_mm = all.residual_mm();
  const ScoreNoise noise = score_noise(field, radius_mm / now.pitch_mm);
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
  if (all.pixel.size() < kFewest) return out;
  out.found = true;
  out.motion = guess.motion();
  out.at_mm = guess.middle + guess.shift;
  out.overlap = static_cast<double>(all.pixel.size()) /
                static_cast<double>(std::min(there.inside.size(), here.inside.size()));
  judge(all, here, radius_mm, guess, options, out);
  return out;
}

}  // namespace palpate

// The fit itself: weights from the presses, and how far off they are on presses left out.
#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <span>
#include <vector>

#include "engine/calibrate/photometric/fit.h"
#include "engine/calibrate/photometric/judge.h"
#include "engine/calibrate/photometric/press.h"
#include "engine/calibrate/photometric/seen.h"
#include "engine/calibrate/photometric/slope_errors.h"
#include "engine/numeric/dense.h"
#include "palpate/error.h"

namespace palpate {
namespace {

using photometric::ErrorSums, photometric::Moments, photometric::Patch, photometric::kPlaces;

constexpr double kMostGain = 1.25;       // that weights are rid of
constexpr double kClearlyBetter = 0.98;  // error over a simpler model's, for a richer one to be chosen

// Numbers of the terms that an order has, ten to a colour.
std::vector<int> terms_of(const NormalOrder& order) {
  std::vector<int> terms;
  for (int c = 0; c < photometric::kColours; ++c)
    for (int p = 0; p < photometric::places_of(c < 3 ? order.colours : order.products); ++p)
      terms.push_back(c * kPlaces + p);
  return terms;
}

// A fitted model.
struct Model {
  PhotometricCalibration weights;
  double condition = 0;
  double ridge = 0;
};

// How presses make weights.
struct Fitting {
  size_t share = 0;       // of kFollowedShares
  double depth_gain = 1;  // of presses left out, that the weights are rid of
};

Model fit_model(const Moments& sums, const NormalOrder& order, const Fitting& fitting) {
  const std::vector<int> terms = terms_of(order);
  const auto n = static_cast<Eigen::Index>(terms.size());
  Eigen::MatrixXd gram = sums.gram(terms);
  // Columns of one length: a product of changes is as good a term as a change.
  Eigen::VectorXd unit(n);
  for (Eigen::Index i = 0; i < n; ++i) unit[i] = gram(i, i) > 0 ? 1 / std::sqrt(gram(i, i)) : 0;
  gram = unit.asDiagonal() * gram * unit.asDiagonal();
  Eigen::MatrixXd right(n, 2);
  for (Eigen::Index i = 0; i < n; ++i)
    right.row(i) = unit[i] * sums.to_normal.row(terms[static_cast<size_t>(i)]);
  const Eigen::VectorXd eigenvalues = dense::symmetric_eigenvalues(gram);
  const double largest = std::max(eigenvalues[n - 1], 0.0), smallest = std::max(eigenvalues[0], 0.0);
  Model model;
  // The Gram matrix squares the condition, so what rounding leaves of a singular design is about 1e-8.
  model.condition = smallest > 0 ? std::sqrt(largest / smallest) : INFINITY;
  Eigen::MatrixXd weights = Eigen::MatrixXd::Zero(n, 2);
  if (largest > 0) {
    if (!(model.condition <= PhotometricFit::kWorstCondition)) {
      model.ridge = 1 / (PhotometricFit::kWorstCondition * PhotometricFit::kWorstCondition);
      gram.diagonal().array() += model.ridge * largest;
    }
    const dense::Ldlt solver(gram);
    weights = solver.solve(right);
    // One step of refinement wins back the digits that the squared condition costs.
    weights += solver.solve(Eigen::MatrixXd(right - gram * weights));
  }
  const size_t places = static_cast<size_t>(photometric::places_of(std::max(order.colours, order.products)));
  model.weights.wx.assign(order.products < 0 ? 3 : photometric::kColours, std::vector<double>(places));
  model.weights.wy = model.weights.wx;
  for (Eigen::Index i = 0; i < n; ++i) {
    const auto colour = static_cast<size_t>(terms[static_cast<size_t>(i)] / kPlaces),
               place = static_cast<size_t>(terms[static_cast<size_t>(i)] % kPlaces);
    model.weights.wx[colour][place] = unit[i] * weights(i, 0) / fitting.depth_gain;
    model.weights.wy[colour][place] = unit[i] * weights(i, 1) / fitting.depth_gain;
  }
  return model;
}

// How well one model does on what it was not fitted to.
struct Validation {
  ErrorSums press, ball;
  std::vector<HeldOutPress> presses, balls;  // each press, judged without it and without its ball

  // Squared errors that count: of each press and, with several balls, of each once more without its ball.
  std::vector<double> squares(bool by_depth) const {
    std::vector<double> all;
    for (const auto* judged : {&presses, &balls})
      for (const HeldOutPress& p : *judged)
        all.push_back(by_depth ? p.depth_rmse_mm * p.depth_rmse_mm : p.normal_rms * p.normal_rms);
    return all;
  }
};

std::vector<Validation> validate(std::span<const PhotometricPress> presses,
                                 std::span<const NormalOrder> orders, const Fitting& fitting,
                                 double rest_weight, double pitch_mm_per_px) {
  const auto sums_of = [&](const auto& wanted) {
    Moments sums;
    for (const PhotometricPress& p : presses)
      if (wanted(p)) p.add_to(sums, fitting.share, rest_weight);
    return sums;
  };
  const auto shape_of = [](const PhotometricPress& p) { return p.truth ? p.truth->shape : PressedShape{}; };
  std::map<PressedShape, std::vector<Model>> without_shape;
  for (const PhotometricPress& p : presses) without_shape[shape_of(p)];
  if (without_shape.size() > 1)
    for (auto& [shape, models] : without_shape) {
      const Moments sums =
          sums_of([&, &left = shape](const PhotometricPress& p) { return shape_of(p) != left; });
      for (const NormalOrder& order : orders) models.push_back(fit_model(sums, order, fitting));
    }
  std::vector<Validation> validations(orders.size());
  for (const PhotometricPress& p : presses) {
    const Moments others = sums_of([&](const PhotometricPress& other) { return &other != &p; });
    std::optional<Patch> patch;
    if (p.truth) patch.emplace(p.truth->inside, p.truth->width, true);
    const auto judged = [&](const Model& model, ErrorSums& sums) {
      return judge(p, model.weights, patch ? &*patch : nullptr, pitch_mm_per_px, sums);
    };
    const std::vector<Model>& other_shapes = without_shape.at(shape_of(p));
    for (size_t k = 0; k < orders.size(); ++k) {
      Validation& v = validations[k];
      v.presses.push_back(judged(fit_model(others, orders[k], fitting), v.press));
      if (!other_shapes.empty()) v.balls.push_back(judged(other_shapes[k], v.ball));
    }
  }
  return validations;
}

double mean_of(std::span<const double> values) {
  double sum = 0;
  for (const double v : values) sum += v;
  return sum / static_cast<double>(values.size());
}

// Squared errors of models on the same presses left out.
using Squares = std::vector<std::vector<double>>;

Squares squares_of(const std::vector<Validation>& validations) {
  const bool by_depth = validations.front().press.balls > 0;
  Squares squares;
  for (const Validation& v : validations) squares.push_back(v.squares(by_depth));
  return squares;
}

size_t least_of(const Squares& squares) {
  size_t best = 0;
  for (size_t k = 1; k < squares.size(); ++k)
    if (mean_of(squares[k]) < mean_of(squares[best])) best = k;
  return best;
}

// No more than a standard error above the least, press by press, or than nobody would notice.
bool as_good(const std::vector<double>& squares, const std::vector<double>& least) {
  const double more = mean_of(squares) - mean_of(least), n = static_cast<double>(squares.size());
  double scatter = 0;
  for (size_t i = 0; i < squares.size(); ++i) scatter += std::pow(squares[i] - least[i] - more, 2);
  return mean_of(least) > std::pow(kClearlyBetter, 2) * mean_of(squares) ||
         more <= std::sqrt(scatter / (n * (n - 1)));
}

// The simplest model that is as good as the best.
size_t choose_order(const std::vector<Validation>& validations) {
  const Squares squares = squares_of(validations);
  const size_t best = least_of(squares);
  size_t k = 0;
  while (k < best && !as_good(squares[k], squares[best])) ++k;
  return k;
}

// The largest share with which presses left out are read neither too flat nor too deep: steep slopes that
// were left out of the fit are read too flat on other shapes, and where the pad has left the ball it is less
// steep than the fit was told.
size_t choose_share(const std::vector<Validation>& shares) {
  constexpr double kFaithful = 0.05;  // of the depth
  const auto off = [&](size_t k) { return std::abs(shares[k].press.errors().depth_gain - 1); };
  size_t best = 0;
  for (size_t k = 1; k < shares.size(); ++k)
    if (off(k) < std::max(kFaithful, off(best))) best = k;
  return best;
}

// How many of the presses lie half a contact's radius or more apart; known normals count as everywhere.
int separate_places(std::span<const PhotometricPress> presses) {
  std::vector<const FoundBall*> places;
  for (const PhotometricPress& p : presses) {
    if (!p.truth) return kPlaces;
    const FoundBall& contact = p.truth->contact;
    const auto near = [&](const FoundBall* other) {
      return std::hypot(contact.center_x_px - other->center_x_px, contact.center_y_px - other->center_y_px) <
             0.5 * std::max(contact.radius_px, other->radius_px);
    };
    if (std::none_of(places.begin(), places.end(), near)) places.push_back(&contact);
  }
  return static_cast<int>(places.size());
}

// The models to judge. One whose place has more terms than there are places pressed would be judged where it
// was fitted, whatever press is left out; products of colours, at places whose colours it was fitted to.
std::vector<NormalOrder> orders_for(NormalModel wanted, std::span<const PhotometricPress> presses) {
  const int places = separate_places(presses);
  const auto judged = [places](const NormalOrder& order) {
    return photometric::places_of(order.colours) <= std::max(places, photometric::places_of(1)) &&
           (order.products < 0 || photometric::places_of(order.products) <= places);
  };
  std::vector<NormalOrder> orders;
  for (const NormalOrder& order : kNormalOrders)
    if (wanted == order.model || (wanted == NormalModel::Best && judged(order))) orders.push_back(order);
  return orders;
}

// Throws where slopes of one direction alone are known, as under cylinders that all lie alike.
void check_directions(std::span<const PhotometricPress> presses) {
  constexpr double kLeast = 0.02;  // weaker over stronger direction: of two axes 16 degrees apart
  Eigen::Matrix2d sum = Eigen::Matrix2d::Zero();
  for (const PhotometricPress& p : presses)
    for (const Eigen::Vector2f& n : p.normals) sum += n.cast<double>() * n.cast<double>().transpose();
  const Eigen::VectorXd strength = dense::symmetric_eigenvalues(sum);
  if (strength[0] < kLeast * strength[1])
    throw Error(Failure::Input, "slopes in all directions",
                "those along one line: cylinders that all lie alike",
                "turning the cylinder by about 90 degrees between presses, or presses of a ball as well");
}

// Fills the shares explained; throws where the colours do not determine both slopes.
void explain(std::span<const PhotometricPress> presses, const ErrorSums& errors,
             PhotometricFitResult& result) {
  Eigen::Vector2d sum = Eigen::Vector2d::Zero(), squares = sum;
  for (const PhotometricPress& p : presses)
    for (const Eigen::Vector2f& n : p.normals) {
      sum += n.cast<double>();
      squares += n.cast<double>().cwiseAbs2();
    }
  const Eigen::Vector2d spread = squares - sum.cwiseAbs2() / static_cast<double>(result.contact_px);
  result.explained_x = spread[0] > 0 ? 1 - errors.square[0] / spread[0] : 0;
  result.explained_y = spread[1] > 0 ? 1 - errors.square[1] / spread[1] : 0;
  const double least = std::min(result.explained_x, result.explained_y);
  if (!(least >= PhotometricFit::kLeastExplained))
    throw Error(Failure::Input, "colour changes that predict both slopes on presses not used for the fit",
                "at best " + std::to_string(static_cast<int>(100 * std::max(least, 0.0))) +
                    " % of the normals explained",
                "images lit by three colours from different sides, and checked centres and radii");
}

}  // namespace

PhotometricFitResult PhotometricFit::solve(double rest_weight, NormalModel wanted) const {
  if (!(rest_weight >= 0 && rest_weight <= 1000))
    throw Error(Failure::Input, "a rest weight from 0 to 1000", std::to_string(rest_weight), "1");
  if (presses_.size() < 2)
    throw Error(Failure::Input, "two presses or more, so that the error is measured on one that was not used",
                std::to_string(presses_.size()), "adding presses at other places of the pad");
  check_directions(presses_);
  const std::vector<NormalOrder> orders = orders_for(wanted, presses_);
  std::vector<Validation> validations = validate(presses_, orders, {}, rest_weight, pitch_mm_per_px_);
  const size_t chosen = choose_order(validations);
  Fitting fitting;
  if (validations[chosen].press.balls > 0) {
    const auto judged = [&](const Fitting& by) {
      return validate(presses_, std::span(&orders[chosen], 1), by, rest_weight, pitch_mm_per_px_)[0];
    };
    std::vector<Validation> shares = {validations[chosen]};
    while (shares.size() < kFollowedShares.size()) shares.push_back(judged({.share = shares.size()}));
    fitting.share = choose_share(shares);
    fitting.depth_gain =
        std::clamp(shares[fitting.share].press.errors().depth_gain, 1 / kMostGain, kMostGain);
    validations[chosen] = judged(fitting);
  }
  PhotometricFitResult result;
  result.followed_share = kFollowedShares[fitting.share];
  for (size_t k = 0; k < orders.size(); ++k) {
    NormalCandidate& c = result.candidates.emplace_back();
    c.order = orders[k];
    c.press = validations[k].press.errors();
    if (!validations[k].balls.empty()) c.ball = validations[k].ball.errors();
  }
  result.chosen = chosen;
  Moments sums;
  for (const PhotometricPress& p : presses_) {
    p.add_to(sums, fitting.share, rest_weight);
    result.contact_px += p.pixels.size();
  }
  const Model model = fit_model(sums, orders[result.chosen], fitting);
  const HeldOutErrors& errors = result.model().press;
  result.presses = validations[result.chosen].presses;
  result.calibration = model.weights;
  result.calibration.normal_sd = errors.normal_rms;
  photometric::state_parts(presses_, frame_noise_, format_, result.calibration);
  result.calibration.presses = photometric::press_errors(presses_, result.presses, format_);
  result.calibration.colours = photometric::seen_colours(presses_);
  result.condition = model.condition;
  result.ridge = model.ridge;
  ErrorSums own;
  for (const PhotometricPress& p : presses_) judge(p, model.weights, nullptr, pitch_mm_per_px_, own);
  result.normal_rms_fitted = own.errors().normal_rms;
  result.normal_rms_held_out = errors.normal_rms;
  result.normal_angle_deg = errors.normal_angle_deg;
  result.depth_rmse_mm = errors.depth_rmse_mm;
  result.cap_rms_mm = errors.cap_rms_mm;
  result.depth_gain = errors.depth_gain;
  explain(presses_, validations[result.chosen].press, result);
  return result;
}

std::vector<double> integrate_patch(std::span<const double> slope_x, std::span<const double> slope_y,
                                    std::span<const uint8_t> inside, uint32_t width, double pitch_mm_per_px) {
  return Patch(inside, width, false).depth(slope_x, slope_y, pitch_mm_per_px);
}

}  // namespace palpate

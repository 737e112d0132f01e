#include "capture/calibrate/frame/scale.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <numeric>
#include <opencv2/calib3d.hpp>
#include <opencv2/features2d.hpp>
#include <opencv2/imgproc.hpp>

#include "engine/base/statistics.h"
#include "engine/base/text.h"
#include "palpate/error.h"

namespace palpate {
namespace {

/// Brightness (or its change), smoothed a little and stretched to 8 bits.
cv::Mat picture_of(const Frame& frame, const Frame* rest) {
  const FrameFormat& f = frame.format;
  cv::Mat sum(static_cast<int>(f.height), static_cast<int>(f.width), CV_32F, cv::Scalar(0));
  const auto plane = [&](const Frame& of, uint32_t c) {
    cv::Mat out;
    cv::Mat(sum.size(), f.bit_depth > 8 ? CV_16UC1 : CV_8UC1, const_cast<uint8_t*>(of.row(c, 0)))
        .convertTo(out, CV_32F);
    return out;
  };
  for (uint32_t c = 0; c < f.channels; ++c) {
    sum += plane(frame, c);
    if (rest) sum -= plane(*rest, c);
  }
  return sum;
}

cv::Mat stretched(const cv::Mat& image) {
  double low = 0, high = 0;
  cv::minMaxLoc(image, &low, &high);
  cv::Mat out;
  image.convertTo(out, CV_8U, 255 / std::max(high - low, 1.0), -low * 255 / std::max(high - low, 1.0));
  return out;
}

/// Dots of one brightness, by blobs of any size that a grid of so many could have.
bool find_dots(const cv::Mat& image, cv::Size grid, bool dark, std::vector<cv::Point2f>& points) {
  const double cell = std::sqrt(static_cast<double>(image.total()) / grid.area());
  cv::SimpleBlobDetector::Params p;
  p.blobColor = dark ? 0 : 255;
  p.minArea = static_cast<float>(std::max(4.0, 0.01 * cell * cell));
  p.maxArea = static_cast<float>(0.8 * cell * cell);
  p.minDistBetweenBlobs = static_cast<float>(0.25 * cell);
  p.thresholdStep = 5;
  p.minThreshold = 5;
  p.maxThreshold = 250;
  p.minRepeatability = 3;
  p.filterByConvexity = p.filterByInertia = false;
  p.filterByCircularity = false;
  return cv::findCirclesGrid(image, grid, points, cv::CALIB_CB_SYMMETRIC_GRID | cv::CALIB_CB_CLUSTERING,
                             cv::SimpleBlobDetector::create(p)) ||
         cv::findCirclesGrid(image, grid, points, cv::CALIB_CB_SYMMETRIC_GRID,
                             cv::SimpleBlobDetector::create(p));
}

/// Moves each dot to the centroid of what stands out around it: blobs are found at thresholds, which shift
/// with uneven light.
void refine_dots(const cv::Mat& image, bool dark, double spacing_px, std::vector<cv::Point2f>& points) {
  const int reach = std::max(2, static_cast<int>(0.4 * spacing_px));
  for (cv::Point2f& point : points)
    for (int round = 0; round < 4; ++round) {
      const cv::Rect box =
          cv::Rect(cvRound(point.x) - reach, cvRound(point.y) - reach, 2 * reach + 1, 2 * reach + 1) &
          cv::Rect({}, image.size());
      cv::Mat part = image(box) * (dark ? -1.0 : 1.0);
      std::vector<float> values(part.begin<float>(), part.end<float>());
      std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2),
                       values.end());
      double high = 0;
      cv::minMaxLoc(part, nullptr, &high);
      const double level = 0.5 * (static_cast<double>(values[values.size() / 2]) + high);
      double sum = 0, x = 0, y = 0;
      for (int v = 0; v < part.rows; ++v)
        for (int u = 0; u < part.cols; ++u) {
          const double w = std::max(0.0, static_cast<double>(part.at<float>(v, u)) - level);
          sum += w;
          x += w * (box.x + u);
          y += w * (box.y + v);
        }
      if (sum > 0) point = {static_cast<float>(x / sum), static_cast<float>(y / sum)};
    }
}

/// Brightness less that around, over how much it varies there: light that falls off hides no square.
cv::Mat evened(const cv::Mat& image) {
  cv::Mat around, squares, spread;
  const double reach_px = 0.05 * image.cols;
  cv::GaussianBlur(image, around, {}, reach_px);
  const cv::Mat apart = image - around;
  cv::GaussianBlur(apart.mul(apart), squares, {}, reach_px);
  cv::sqrt(squares, spread);
  double most = 0;
  cv::minMaxLoc(spread, nullptr, &most);
  constexpr double kLeast = 0.15;  // of the largest: what varies less is no board but noise
  cv::Mat out = apart / cv::max(spread, std::max(kLeast * most, 1e-3));
  return cv::max(cv::min(out, 2.0), -2.0);
}

/// Whether the squares between the corners are dark and light by turns, as those of a board and of nothing
/// else that the finder takes for one.
bool alternates(const cv::Mat& image, cv::Size grid, const std::vector<cv::Point2f>& points) {
  std::array<std::vector<double>, 2> sides;
  for (int row = 0; row + 1 < grid.height; ++row)
    for (int column = 0; column + 1 < grid.width; ++column) {
      const auto corner = [&](int r, int c) { return points[static_cast<size_t>(r * grid.width + c)]; };
      const cv::Point2f middle = 0.25f * (corner(row, column) + corner(row, column + 1) +
                                          corner(row + 1, column) + corner(row + 1, column + 1));
      cv::Mat one;
      cv::getRectSubPix(image, {1, 1}, middle, one);
      sides[static_cast<size_t>((row + column) % 2)].push_back(static_cast<double>(one.at<float>(0)));
    }
  if (sides[0].empty() || sides[1].empty()) return true;
  size_t right = 0;
  const double level = 0.5 * (median(sides[0]) + median(sides[1]));
  const bool first_is_light = median(sides[0]) > level;
  for (const size_t side : {size_t{0}, size_t{1}})
    for (const double value : sides[side]) right += (value > level) == ((side == 0) == first_is_light);
  constexpr double kMost = 0.9;  // glare may hide a square
  return static_cast<double>(right) >= kMost * static_cast<double>(sides[0].size() + sides[1].size());
}

/// Inner corners of a chessboard of any size and turn. The finder fails on small boards where it evens the
/// whole picture out, so that comes last; enlarged pictures show it small squares, those made smaller blurred
/// ones.
bool find_board(const cv::Mat& image, cv::Size grid, std::vector<cv::Point2f>& points) {
  constexpr int kPlain = cv::CALIB_CB_EXHAUSTIVE | cv::CALIB_CB_ACCURACY;
  constexpr double kSmall_px = 640, kLarge_px = 1280;
  struct Try {
    bool even;
    double enlarged;
    int flags;
  };
  const double width = image.cols;
  std::vector<Try> tries;
  if (width > kLarge_px)
    for (const bool even : {false, true}) tries.push_back({even, kSmall_px / width, kPlain});
  tries.push_back({false, 1, kPlain});
  tries.push_back({true, 1, kPlain});
  if (width <= kLarge_px)
    for (const bool even : {false, true}) tries.push_back({even, 2, kPlain});
  tries.push_back({false, 1, kPlain | cv::CALIB_CB_NORMALIZE_IMAGE});
  const cv::Mat even = evened(image);
  cv::Mat smooth;
  cv::GaussianBlur(image, smooth, {}, 0.8);
  for (const Try& t : tries) {
    cv::Mat looked;
    cv::resize(stretched(t.even ? even : image), looked, {}, t.enlarged, t.enlarged,
               t.enlarged < 1 ? cv::INTER_AREA : cv::INTER_CUBIC);
    points.clear();
    if (!cv::findChessboardCornersSB(looked, grid, points, t.flags)) continue;
    const auto enlarged = static_cast<float>(t.enlarged);
    for (cv::Point2f& p : points) p = (p + cv::Point2f(0.5f, 0.5f)) / enlarged - cv::Point2f(0.5f, 0.5f);
    if (!alternates(smooth, grid, points)) continue;
    if (t.enlarged < 1) {
      // Found in less detail: sharpened in the picture itself, within a third of a square.
      const int reach = std::clamp(static_cast<int>(0.3 * cv::norm(points[1] - points[0])), 3, 20);
      cv::cornerSubPix(smooth, points, {reach, reach}, {-1, -1},
                       {cv::TermCriteria::EPS | cv::TermCriteria::COUNT, 30, 0.01});
    }
    return true;
  }
  return false;
}

}  // namespace

std::optional<GridView> find_grid(const Frame& picture, const Frame* rest, GridPattern pattern, int columns,
                                  int rows, double spacing_mm) {
  const cv::Size grid(columns, rows);
  cv::Mat image = picture_of(picture, rest);
  std::vector<cv::Point2f> points;
  if (pattern == GridPattern::Chessboard) {
    if (!find_board(image, grid, points)) return std::nullopt;
  } else {
    // Light that falls off towards the border would hide dots there.
    cv::Mat smooth, around;
    const double cell = std::sqrt(static_cast<double>(image.total()) / grid.area());
    cv::GaussianBlur(image, smooth, {}, std::max(0.8, 0.04 * cell));
    cv::GaussianBlur(image, around, {}, 0.8 * cell);
    image = smooth - around;
    bool dark = true, found = false;
    for (const bool try_dark : {true, false}) {
      cv::Mat clipped = try_dark ? cv::Mat(-image) : image;
      clipped = cv::max(clipped, 0.0);
      dark = try_dark;
      if ((found = find_dots(stretched(clipped), grid, false, points))) break;
    }
    if (!found) return std::nullopt;
    std::vector<float> gaps;
    for (size_t i = 1; i < points.size(); ++i)
      if (i % static_cast<size_t>(columns) != 0)
        gaps.push_back(static_cast<float>(cv::norm(points[i] - points[i - 1])));
    std::nth_element(gaps.begin(), gaps.begin() + static_cast<std::ptrdiff_t>(gaps.size() / 2), gaps.end());
    refine_dots(image, dark, static_cast<double>(gaps[gaps.size() / 2]), points);
  }
  GridView view;
  for (size_t i = 0; i < points.size(); ++i) {
    view.seen_px.push_back({static_cast<double>(points[i].x), static_cast<double>(points[i].y)});
    const size_t column = i % static_cast<size_t>(columns), row = i / static_cast<size_t>(columns);
    view.grid_mm.push_back({spacing_mm * static_cast<double>(column), spacing_mm * static_cast<double>(row)});
  }
  return view;
}

Scale scale_from_ring(const Frame& picture, const Frame& rest, double diameter_mm) {
  cv::Mat change = cv::abs(picture_of(picture, &rest));
  cv::GaussianBlur(change, change, {5, 5}, 0);
  double peak = 0;
  cv::minMaxLoc(change, nullptr, &peak);
  cv::Scalar mean, sd;
  cv::meanStdDev(change, mean, sd);
  if (peak < 5 * std::max(1.0, mean[0]))
    throw Error(Failure::Input, "a ring or disc that changes the picture",
                "a change of " + std::to_string(peak) + " gray at most",
                "a firmer press, or the untouched --background");
  const cv::Mat mask = change > 0.5 * peak;
  std::vector<std::vector<cv::Point>> outlines;
  cv::findContours(mask, outlines, cv::RETR_EXTERNAL, cv::CHAIN_APPROX_NONE);
  const auto largest = std::max_element(outlines.begin(), outlines.end(), [](const auto& a, const auto& b) {
    return cv::contourArea(a) < cv::contourArea(b);
  });
  const cv::Rect box = largest == outlines.end() ? cv::Rect() : cv::boundingRect(*largest);
  if (box.width < 12 || box.x < 1 || box.y < 1 || box.br().x >= change.cols - 1 ||
      box.br().y >= change.rows - 1)
    throw Error(Failure::Input, "a ring or disc that is wholly in view", "nothing round clear of the border",
                "another press");
  // Sub-pixel edge: along rays from the middle, where the change passes half of its peak for the last time.
  const cv::Point2d centre(box.x + 0.5 * (box.width - 1), box.y + 0.5 * (box.height - 1));
  std::vector<cv::Point2f> edge;
  const double far = std::hypot(change.cols, change.rows);
  constexpr int kRays = 360;
  for (int k = 0; k < kRays; ++k) {
    const cv::Point2d along(std::cos(2 * CV_PI * k / kRays), std::sin(2 * CV_PI * k / kRays));
    double last = -1, before = 0;
    for (double r = 0; r < far; r += 0.5) {
      const cv::Point2d p = centre + along * r;
      if (p.x < 0 || p.y < 0 || p.x > change.cols - 1 || p.y > change.rows - 1) break;
      cv::Mat one;
      cv::getRectSubPix(change, {1, 1}, cv::Point2f(p), one);
      const double value = static_cast<double>(one.at<float>(0)), level = 0.5 * peak;
      if (before >= level && value < level && r < 0.75 * std::max(box.width, box.height))
        last = r - 0.5 * (level - value) / (before - value);
      before = value;
    }
    if (last > 0) edge.emplace_back(cv::Point2f(centre + along * last));
  }
  if (edge.size() < kRays * 3 / 4)
    throw Error(Failure::Input, "the whole edge of a ring or disc",
                std::to_string(edge.size()) + " of 360 directions", "another press");
  const cv::RotatedRect ellipse = cv::fitEllipse(edge);
  const double across =
      std::sqrt(static_cast<double>(ellipse.size.width) * static_cast<double>(ellipse.size.height));
  const double aspect = static_cast<double>(std::max(ellipse.size.width, ellipse.size.height) /
                                            std::min(ellipse.size.width, ellipse.size.height));
  double square = 0;
  for (const cv::Point2f& p : edge) {
    const double r = cv::norm(cv::Point2d(p) - cv::Point2d(ellipse.center));
    square += std::pow(r - 0.5 * across, 2) / static_cast<double>(edge.size());
  }
  constexpr double kMostOval = 1.15;
  if (aspect > kMostOval || std::sqrt(square) > 0.1 * across)
    throw Error(Failure::Input, "a round outline",
                "one " + std::to_string(aspect) + " times as long as wide, " +
                    std::to_string(std::sqrt(square)) + " px rough",
                "rectifying the image first (a grid does both)");
  Scale scale;
  scale.size_px = across;
  scale.pitch_mm_per_px = diameter_mm / across;
  // Half a pixel for where the edge lies in the blur, and the roughness of the outline.
  scale.pitch_sd_mm_per_px =
      scale.pitch_mm_per_px * std::hypot(0.5, 2 * std::sqrt(square) / std::sqrt(36.0)) / across;
  scale.note = "ring of " + std::to_string(diameter_mm) + " mm, " + std::to_string(across) + " px across";
  return scale;
}

Scale scale_from_ball(const std::vector<double>& radii_px, const std::vector<double>& travel_mm,
                      double ball_radius_mm) {
  const size_t n = radii_px.size();
  if (n < 3 || n != travel_mm.size())
    throw Error(Failure::Input, "three presses or more, each with its travel",
                std::to_string(n) + " presses and " + std::to_string(travel_mm.size()) + " travels",
                "--travel-mm with one number a press");
  // a^2 pitch^2 = k R d + const, with the sphere's own -d^2 in the rigid cut: slope of d over a^2.
  const auto pitch = [&](bool rigid, double& relative_sd) {
    std::vector<double> x, y;
    const double first = *std::min_element(travel_mm.begin(), travel_mm.end());
    for (size_t i = 0; i < n; ++i) {
      const double d = travel_mm[i] - first;
      x.push_back(radii_px[i] * radii_px[i]);
      y.push_back(rigid ? 2 * ball_radius_mm * d - d * d : ball_radius_mm * d);
    }
    const double mx = std::accumulate(x.begin(), x.end(), 0.0) / static_cast<double>(n),
                 my = std::accumulate(y.begin(), y.end(), 0.0) / static_cast<double>(n);
    double xx = 0, xy = 0, left = 0;
    for (size_t i = 0; i < n; ++i) xx += (x[i] - mx) * (x[i] - mx), xy += (x[i] - mx) * (y[i] - my);
    const double slope = xx > 0 ? xy / xx : 0;
    if (!(slope > 0))
      throw Error(Failure::Input, "contacts that grow with the travel", "contacts that do not",
                  "--travel-mm in the order of the presses, deeper is more");
    for (size_t i = 0; i < n; ++i) left += std::pow(y[i] - my - slope * (x[i] - mx), 2);
    relative_sd = 0.5 * std::sqrt(left / static_cast<double>(n - 2) / xx) / slope;
    return std::sqrt(slope);
  };
  double sd_hertz = 0, sd_rigid = 0;
  const double hertz = pitch(false, sd_hertz), rigid = pitch(true, sd_rigid);
  Scale scale;
  scale.pitch_mm_per_px = std::sqrt(hertz * rigid);
  scale.pitch_sd_mm_per_px =
      std::hypot(0.5 * std::abs(rigid - hertz), scale.pitch_mm_per_px * std::max(sd_hertz, sd_rigid));
  scale.size_px = *std::max_element(radii_px.begin(), radii_px.end());
  const std::string note =
      text("ball of %.3f mm in %zu presses: %.4f mm/px as a half space, %.4f as a rigid cut", ball_radius_mm,
           n, hertz, rigid);
  scale.note = note;
  return scale;
}

}  // namespace palpate

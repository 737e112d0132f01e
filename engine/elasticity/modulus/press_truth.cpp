#include "engine/elasticity/modulus/press_truth.h"

#include <algorithm>
#include <cmath>

#include "palpate/error.h"

namespace palpate {
namespace {

constexpr double kPadWidth = 10;    // its radius in thicknesses
constexpr int kLayoutRounds = 2;    // of laying the pad out for a widened face
constexpr double kBallFace = 0.52;  // radius of the ball's face in its own

double finest(const std::vector<double>& at) {
  double least = at.back();
  for (size_t i = 1; i < at.size(); ++i) least = std::min(least, at[i] - at[i - 1]);
  return least;
}

/// Growth with which `count` steps over `length` end with about `last`.
double growth_to(double length, int count, double last) {
  double growth = 1.005;
  for (; growth < 1.5; growth += 0.005) {
    const std::vector<double> at = graded(0, length, count, growth);
    if (at[1] < last) break;
  }
  return growth;
}

FaceCompliance pad_elements(const Pad& body, const std::vector<double>& face, int nodes) {
  const Pad pad{{1, body.material.poisson}, body.thickness_mm, body.base};
  std::vector<double> radii = face;
  double step = std::max(radii.back() - radii[radii.size() - 2], 0.01 * radii.back());
  const double width = kPadWidth * pad.thickness_mm + face.back();
  while (radii.back() < width) {
    radii.push_back(radii.back() + step);
    step = std::min(1.12 * step, 0.3 * pad.thickness_mm);
  }
  const int layers = std::max(16, nodes * 2 / 3);
  const double growth = growth_to(pad.thickness_mm, layers, std::max(finest(face), pad.thickness_mm / 400));
  return face_compliance(cylinder_mesh(radii, graded(0, pad.thickness_mm, layers, 1 / growth), face.back()),
                         std::min(pad.material.poisson, kMostPoisson),
                         pad.base == Base::Bonded ? Support::Bonded : Support::Sliding);
}

}  // namespace

double TruePress::pressure_at_MPa(double r) const {
  if (r_mm.empty() || r > r_mm.back()) return 0;
  const auto after = std::upper_bound(r_mm.begin(), r_mm.end(), r);
  if (after == r_mm.begin()) return pressure_MPa.front();
  if (after == r_mm.end()) return pressure_MPa.back();
  const auto i = static_cast<size_t>(after - r_mm.begin());
  const double t = (r - r_mm[i - 1]) / (r_mm[i] - r_mm[i - 1]);
  return pressure_MPa[i - 1] + t * (pressure_MPa[i] - pressure_MPa[i - 1]);
}

PressTruth::PressTruth(const Pad& pad, const Sample& sample, int nodes)
    : body_(pad), sample_(sample), nodes_(nodes) {
  check(sample, pad);
  if (sample.shape == SampleShape::Dome)
    throw Error(Failure::Input, "a sample of finite elements: cube, cylinder or sphere", "a dome",
                "a sphere");
  const double radius = sample.radius_mm(), poisson = std::min(sample.poisson, kMostPoisson);
  std::vector<double> face;
  if (sample.flat()) {
    // Steps shrink towards the edge to a sixtieth of the mean.
    face = graded(0, radius, nodes, 1 / std::pow(60, 1.4 / nodes));
    const double growth = growth_to(sample.height_mm, nodes, finest(face));
    own_ = face_compliance(cylinder_mesh(face, graded(0, sample.height_mm, nodes, 1 / growth), radius),
                           poisson, sample.table);
    gap_mm_.assign(face.size(), 0);
  } else {
    face = graded(0, std::min(kBallFace * radius, 6 * pad.thickness_mm), nodes, 1);
    own_ = face_compliance(half_sphere_mesh(radius, face, face[1]), poisson, Support::Sliding);
    for (const double r : own_.r_mm) gap_mm_.push_back(radius - std::sqrt((radius - r) * (radius + r)));
    face = own_.r_mm;
  }
  pad_ = pad_elements(pad, face, nodes);
}

TruePress PressTruth::press(double force_N, double young_MPa, double pad_MPa) const {
  const size_t n = own_.size();
  TruePress p;
  p.force_N = force_N;
  p.r_mm = own_.r_mm;
  FaceCompliance pad = pad_;
  FaceContact c;
  for (int round = 0;; ++round) {
    std::vector<double> both(n * n);
    for (size_t i = 0; i < n * n; ++i) both[i] = own_.down[i] / young_MPa + pad.down[i] / pad_MPa;
    c = press_faces(both, gap_mm_, force_N);
    if (!sample_.flat() || round == kLayoutRounds) break;
    for (size_t i = 0; i < n; ++i) {
      p.r_mm[i] = own_.r_mm[i];
      for (size_t j = 0; j < n; ++j) p.r_mm[i] += own_.out[i * n + j] / young_MPa * c.force_N[j];
    }
    pad = pad_elements(body_, p.r_mm, nodes_);
  }
  p.converged = c.converged;
  p.approach_mm = c.approach_mm;
  double area = 0, shorter = 0;
  for (size_t i = 0; i < n; ++i) {
    double depth = 0, down = 0;
    for (size_t j = 0; j < n; ++j) {
      depth += pad.down[i * n + j] / pad_MPa * c.force_N[j];
      down += own_.down[i * n + j] / young_MPa * c.force_N[j];
    }
    p.depth_mm = std::max(p.depth_mm, depth);
    p.pressure_MPa.push_back(c.force_N[i] / pad.area_mm2[i]);
    if (c.force_N[i] <= 0) continue;
    area += own_.area_mm2[i];
    p.mean_depth_mm += depth * own_.area_mm2[i];
    shorter += down * own_.area_mm2[i];
  }
  if (area > 0) p.mean_depth_mm /= area;
  if (sample_.flat()) {
    p.strain = area > 0 ? shorter / area / sample_.height_mm : 0;
    return p;
  }
  // The ball's other half on the table.
  std::vector<double> own(own_.down);
  for (double& u : own) u /= young_MPa;
  const FaceContact table = press_faces(own, gap_mm_, force_N);
  p.converged = p.converged && table.converged && c.force_N.back() == 0 && table.force_N.back() == 0;
  p.approach_mm += table.approach_mm;
  return p;
}

}  // namespace palpate

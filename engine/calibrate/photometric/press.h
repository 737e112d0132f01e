// One press of a photometric fit: its normal equations and the pixels behind them.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

namespace palpate {
namespace photometric {

inline constexpr int kCoefficients = 9;
using Matrix9 = Eigen::Matrix<double, kCoefficients, kCoefficients>;
using Vector9 = Eigen::Matrix<double, kCoefficients, 1>;
using Features = Eigen::Matrix<float, kCoefficients, 1>;

/// Normal equations of n = f . w for both components.
struct NormalEquations {
  Matrix9 gram = Matrix9::Zero();
  Vector9 to_x = Vector9::Zero();
  Vector9 to_y = Vector9::Zero();
  double xx = 0, yy = 0, x = 0, y = 0, weight = 0;

  void add(const Vector9& f, double nx, double ny) {
    gram.selfadjointView<Eigen::Lower>().rankUpdate(f);
    to_x += nx * f;
    to_y += ny * f;
    xx += nx * nx;
    yy += ny * ny;
    x += nx;
    y += ny;
    weight += 1;
  }
  void scale(double s) {
    gram *= s;
    to_x *= s;
    to_y *= s;
    xx *= s;
    yy *= s;
    x *= s;
    y *= s;
    weight *= s;
  }
  NormalEquations& operator+=(const NormalEquations& o) {
    gram += o.gram;
    to_x += o.to_x;
    to_y += o.to_y;
    xx += o.xx;
    yy += o.yy;
    x += o.x;
    y += o.y;
    weight += o.weight;
    return *this;
  }
};

}  // namespace photometric

/// The equations of one press, its pixels of known normal, and for a ball the depth to be read from them.
struct PhotometricPress {
  std::string label;
  photometric::NormalEquations contact;
  photometric::NormalEquations rest;
  std::vector<photometric::Features> features;
  std::vector<Eigen::Vector2f> normals;
  struct Ball {
    uint32_t width = 0;
    std::vector<uint8_t> inside;
    std::vector<double> depth_mm;  // of the inside pixels, row by row as the features; rim at 0
  } ball;

  void add(const photometric::Vector9& f, double nx, double ny) {
    contact.add(f, nx, ny);
    features.push_back(f.cast<float>());
    normals.emplace_back(static_cast<float>(nx), static_cast<float>(ny));
  }
  photometric::NormalEquations all(double rest_weight) const {
    photometric::NormalEquations e = rest;
    e.scale(rest_weight);
    e += contact;
    return e;
  }
};

}  // namespace palpate

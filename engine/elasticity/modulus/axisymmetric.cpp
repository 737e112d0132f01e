#include "engine/elasticity/modulus/axisymmetric.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <string>

#include "engine/base/numbers.h"
#include "engine/numeric/dense.h"
#include "engine/numeric/sparse.h"
#include "palpate/error.h"

namespace palpate {
namespace {

using Element = Eigen::Matrix<double, 8, 8>;

/// Stiffness of one quadrilateral at unit modulus, around the whole circle: u_r and u_z of its four corners
/// in turn.
Element element_stiffness(const std::array<std::array<double, 2>, 4>& corner, double poisson) {
  constexpr std::array<double, 4> kXi = {-1, 1, 1, -1}, kEta = {-1, -1, 1, 1};
  const double g = 1 / std::sqrt(3.0);
  const double mu = 1 / (2 * (1 + poisson)), lambda = poisson / ((1 + poisson) * (1 - 2 * poisson));
  Eigen::Matrix4d d = Eigen::Matrix4d::Zero();  // rr, zz, tt, rz
  d.topLeftCorner<3, 3>().setConstant(lambda);
  d.diagonal() += Eigen::Vector4d(2 * mu, 2 * mu, 2 * mu, mu);
  std::array<Eigen::Matrix<double, 4, 8>, 4> b;
  std::array<double, 4> weight{};
  Eigen::Matrix<double, 1, 8> mean = Eigen::Matrix<double, 1, 8>::Zero();
  double volume = 0;
  for (size_t q = 0; q < 4; ++q) {
    const double xi = g * kXi[q], eta = g * kEta[q];
    Eigen::Matrix<double, 2, 4> slope;
    Eigen::Matrix<double, 4, 2> place;
    Eigen::Vector4d value;
    for (int i = 0; i < 4; ++i) {
      const auto k = static_cast<size_t>(i);
      value[i] = (1 + kXi[k] * xi) * (1 + kEta[k] * eta) / 4;
      slope(0, i) = kXi[k] * (1 + kEta[k] * eta) / 4;
      slope(1, i) = kEta[k] * (1 + kXi[k] * xi) / 4;
      place.row(i) << corner[k][0], corner[k][1];
    }
    const Eigen::Matrix2d jacobian = slope * place;
    const double determinant = jacobian.determinant(), r = value.dot(place.col(0));
    if (!(std::abs(determinant) > 0) || !(r > 0))
      throw Error(Failure::Input, "a mesh of proper elements", "one without area", "a coarser grading");
    const Eigen::Matrix<double, 2, 4> gradient = jacobian.inverse() * slope;
    b[q].setZero();
    for (int i = 0; i < 4; ++i) {
      b[q](0, 2 * i) = b[q](3, 2 * i + 1) = gradient(0, i);
      b[q](1, 2 * i + 1) = b[q](3, 2 * i) = gradient(1, i);
      b[q](2, 2 * i) = value[i] / r;
    }
    weight[q] = 2 * kPi * r * std::abs(determinant);
    volume += weight[q];
    mean += weight[q] * b[q].topRows<3>().colwise().sum();
  }
  mean /= volume;
  Element k = Element::Zero();
  for (size_t q = 0; q < 4; ++q) {
    const Eigen::Matrix<double, 1, 8> lack = (mean - b[q].topRows<3>().colwise().sum()) / 3;
    b[q].topRows<3>().rowwise() += lack;
    k += weight[q] * b[q].transpose() * d * b[q];
  }
  return k;
}

}  // namespace

std::vector<double> graded(double from, double to, int count, double growth) {
  double step = 0, power = 1;
  for (int i = 0; i < count; ++i, power *= growth) step += power;
  step = (to - from) / step;
  std::vector<double> at{from};
  for (int i = 1; i < count; ++i, step *= growth) at.push_back(at.back() + step);
  at.push_back(to);
  return at;
}

SolidMesh cylinder_mesh(const std::vector<double>& radii, const std::vector<double>& heights,
                        double top_radius_mm) {
  SolidMesh m;
  const auto columns = static_cast<uint32_t>(radii.size()), rows = static_cast<uint32_t>(heights.size());
  for (const double z : heights)
    for (const double r : radii) m.nodes.push_back({r, z});
  for (uint32_t j = 0; j + 1 < rows; ++j)
    for (uint32_t i = 0; i + 1 < columns; ++i) {
      const uint32_t n = j * columns + i;
      m.quads.push_back({n, n + 1, n + columns + 1, n + columns});
    }
  for (uint32_t i = 0; i < columns; ++i) {
    m.base.push_back(i);
    if (radii[i] <= top_radius_mm * (1 + 1e-12)) m.top.push_back((rows - 1) * columns + i);
  }
  return m;
}

SolidMesh half_sphere_mesh(double radius, const std::vector<double>& top_radii, double layer_mm) {
  std::vector<double> angles;
  angles.reserve(top_radii.size());
  for (const double r : top_radii) angles.push_back(std::asin(r / radius));
  const size_t face = angles.size();
  double step = angles.back() - angles[face - 2];
  const double rest = kPi / 2 - angles.back();
  const int more = std::max(4, static_cast<int>(std::log(1 + 0.08 * rest / step) / std::log(1.08)));
  for (const double a : graded(angles.back(), kPi / 2, more, 1.08)) {
    if (a > angles.back()) angles.push_back(a);
  }
  std::vector<double> shells{radius};  // inwards; the last shell is the centre itself
  for (step = layer_mm; shells.back() > 1.6 * step; step *= 1.07) shells.push_back(shells.back() - step);
  SolidMesh m;
  const auto columns = static_cast<uint32_t>(angles.size());
  for (const double s : shells)
    for (size_t i = 0; i < columns; ++i) {
      const bool equator = i + 1 == columns;
      m.nodes.push_back({i == 0 ? 0 : s * std::sin(angles[i]), equator ? 0 : s * std::cos(angles[i])});
    }
  const auto centre = static_cast<uint32_t>(m.nodes.size());
  m.nodes.push_back({0, 0});
  for (uint32_t j = 0; j < shells.size(); ++j) {
    const bool last = j + 1 == shells.size();
    for (uint32_t i = 0; i + 1 < columns; ++i) {
      const uint32_t n = j * columns + i;
      m.quads.push_back({n, n + 1, last ? centre : n + columns + 1, last ? centre : n + columns});
    }
    m.base.push_back((j + 1) * columns - 1);
  }
  m.base.push_back(centre);
  for (uint32_t i = 0; i < face; ++i) m.top.push_back(i);
  return m;
}

FaceCompliance face_compliance(const SolidMesh& mesh, double poisson, Support support) {
  if (!(poisson >= 0 && poisson <= 0.4999))
    throw Error(Failure::Input, "a Poisson's ratio from 0 to 0.4999", std::to_string(poisson),
                "0.4999 for an incompressible body");
  const auto nodes = static_cast<int>(mesh.nodes.size());
  std::vector<int> unknown(2 * mesh.nodes.size(), 0);
  for (int n = 0; n < nodes; ++n)
    if (mesh.nodes[static_cast<size_t>(n)][0] == 0) unknown[2 * static_cast<size_t>(n)] = -1;
  for (const uint32_t n : mesh.base) {
    unknown[2 * n + 1] = -1;
    if (support == Support::Bonded) unknown[2 * n] = -1;
  }
  int count = 0;
  for (int& u : unknown)
    if (u == 0) u = count++;
  std::vector<sparse::Entry> entries;
  entries.reserve(mesh.quads.size() * 36);
  for (const auto& quad : mesh.quads) {
    std::array<std::array<double, 2>, 4> corner{};
    for (size_t i = 0; i < 4; ++i) corner[i] = mesh.nodes[quad[i]];
    const Element k = element_stiffness(corner, poisson);
    for (int i = 0; i < 8; ++i)
      for (int j = 0; j < 8; ++j) {
        const int row = unknown[2 * quad[static_cast<size_t>(i / 2)] + static_cast<uint32_t>(i % 2)];
        const int column = unknown[2 * quad[static_cast<size_t>(j / 2)] + static_cast<uint32_t>(j % 2)];
        if (row >= column && column >= 0) entries.emplace_back(row, column, k(i, j));
      }
  }
  const sparse::Factor factor(sparse::Factor::Kind::Ldlt, count, entries);
  if (!factor.ok())
    throw Error(Failure::Input, "a mesh held by its supports", "a mesh that moves freely", "a base");

  FaceCompliance c;
  const size_t n = mesh.top.size();
  for (const uint32_t t : mesh.top) c.r_mm.push_back(mesh.nodes[t][0]);
  c.area_mm2.assign(n, 0);
  for (size_t i = 0; i + 1 < n; ++i) {  // hat functions over a ring
    const double a = c.r_mm[i], b = c.r_mm[i + 1];
    c.area_mm2[i] += 2 * kPi * (b - a) * (2 * a + b) / 6;
    c.area_mm2[i + 1] += 2 * kPi * (b - a) * (a + 2 * b) / 6;
  }
  c.down.resize(n * n);
  c.out.resize(n * n);
  Eigen::VectorXd load = Eigen::VectorXd::Zero(count);
  for (size_t j = 0; j < n; ++j) {
    const int at = unknown[2 * mesh.top[j] + 1];
    load[at] = -1;
    const Eigen::VectorXd u = factor.solve(load);
    load[at] = 0;
    for (size_t i = 0; i < n; ++i) {
      const int r = unknown[2 * mesh.top[i]], z = unknown[2 * mesh.top[i] + 1];
      c.down[i * n + j] = z < 0 ? 0 : -u[z];
      c.out[i * n + j] = r < 0 ? 0 : u[r];
    }
  }
  return c;
}

FaceContact press_faces(const std::vector<double>& compliance, const std::vector<double>& gap_mm,
                        double force_N) {
  const size_t n = gap_mm.size();
  FaceContact contact;
  contact.force_N.assign(n, 0);
  std::vector<char> carries(n, 1);
  // A wide guess only loses nodes in the first rounds; later ones settle the rim.
  constexpr int kRounds = 200;
  for (int round = 0; round < kRounds && !contact.converged; ++round) {
    std::vector<size_t> in;
    for (size_t i = 0; i < n; ++i)
      if (carries[i]) in.push_back(i);
    const auto m = static_cast<Eigen::Index>(in.size());
    Eigen::MatrixXd a = Eigen::MatrixXd::Zero(m + 1, m + 1);
    Eigen::VectorXd right(m + 1);
    const double scale = compliance[0];
    for (Eigen::Index i = 0; i < m; ++i) {
      const size_t row = in[static_cast<size_t>(i)];
      for (Eigen::Index j = 0; j < m; ++j) a(i, j) = compliance[row * n + in[static_cast<size_t>(j)]] / scale;
      a(i, m) = a(m, i) = -1;
      right[i] = -gap_mm[row] / scale;
    }
    right[m] = -force_N;
    const Eigen::VectorXd found = dense::solve_lu(a, right);
    contact.approach_mm = found[m] * scale;
    std::fill(contact.force_N.begin(), contact.force_N.end(), 0.0);
    bool settled = true;
    for (Eigen::Index i = 0; i < m; ++i) {
      const size_t node = in[static_cast<size_t>(i)];
      contact.force_N[node] = std::max(0.0, found[i]);
      if (found[i] < 0) {
        carries[node] = 0;
        settled = false;
      }
    }
    if (settled) {
      for (size_t i = 0; i < n; ++i) {
        if (carries[i]) continue;
        double depth = contact.approach_mm - gap_mm[i];
        for (const size_t j : in) depth -= compliance[i * n + j] * contact.force_N[j];
        if (depth > 1e-12 * std::abs(contact.approach_mm)) {
          carries[i] = 1;
          settled = false;
        }
      }
    }
    contact.converged = settled;
  }
  return contact;
}

}  // namespace palpate

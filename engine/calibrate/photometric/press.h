// One press of a photometric fit: its sums and the pixels behind them.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "engine/calibrate/photometric/polynomial.h"

namespace palpate {

/// The sums of one press, its pixels of known normal, and for a ball the depth to be read from them.
struct PhotometricPress {
  std::string label;
  photometric::Moments contact, rest;
  double rest_factor = 1;  // so that the rest weighs no more than the contact
  std::vector<photometric::Pixel> pixels;
  std::vector<Eigen::Vector2f> normals;
  struct Ball {
    double radius_mm = 0;
    double center_x_px = 0, center_y_px = 0, contact_px = 0;  // contact: its radius
    uint32_t width = 0;
    std::vector<uint8_t> inside;
    std::vector<double> depth_mm;  // of the inside pixels, row by row as the pixels; rim at 0
  } ball;

  void add(const photometric::Pixel& pixel, double nx, double ny) {
    contact.add(pixel, nx, ny);
    pixels.push_back(pixel);
    normals.emplace_back(static_cast<float>(nx), static_cast<float>(ny));
  }
  void add_to(photometric::Moments& sums, double rest_weight) const {
    sums.add(contact, 1);
    sums.add(rest, rest_weight * rest_factor);
  }
};

}  // namespace palpate

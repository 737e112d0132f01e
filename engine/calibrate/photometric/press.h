// One press of a photometric fit: its sums and the pixels behind them.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "engine/calibrate/ball/press.h"
#include "engine/calibrate/photometric/polynomial.h"

namespace palpate {

/// Shares of a contact's found half width up to which the pad may be taken to follow the shape.
inline constexpr std::array kFollowedShares{0.8, 0.9, 1.0};

/// The sums of one press, its pixels of known normal, and for a known shape the depth to be read from them.
struct PhotometricPress {
  std::string label;
  std::array<photometric::Moments, kFollowedShares.size()>
      contact;  // rings, each from the share before to its own
  photometric::Moments rest;
  double rest_factor = 1;  // so that the rest weighs no more than the contact
  std::vector<photometric::Pixel> pixels;
  std::vector<Eigen::Vector2f> normals;
  struct Truth {
    PressedShape shape;
    FoundBall contact;
    uint32_t left_px = 0, top_px = 0, width = 0;  // of the box around the contact
    std::vector<uint8_t> inside;
    std::vector<double> depth_mm;  // of the inside pixels, row by row as the pixels; rim at 0
  };
  std::optional<Truth> truth;  // none: normals were given

  // A pixel of the first share, by which models are judged.
  void add(const photometric::Pixel& pixel, double nx, double ny) {
    contact.front().add(pixel, nx, ny);
    pixels.push_back(pixel);
    normals.emplace_back(static_cast<float>(nx), static_cast<float>(ny));
  }
  void add_to(photometric::Moments& sums, size_t share, double rest_weight) const {
    for (size_t k = 0; k <= share; ++k) sums.add(contact[k], 1);
    sums.add(rest, rest_weight * rest_factor);
  }
};

}  // namespace palpate

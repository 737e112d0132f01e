// Touches as Python sees them: numbers that stay, maps and pixels that are read while the frame is the
// stream's newest.
#pragma once

#include <pybind11/numpy.h>

#include <memory>
#include <string>
#include <vector>

#include "viz/python/stream.h"

namespace palpate::python {

/// Maps of a frame that are read at once when it is handed out.
struct Kept {
  bool depth = false, image = false, confidence = false, traction = false, extrapolated = false;
};
/// Those of the names; throws Refusal of another name.
Kept kept_of(const std::vector<std::string>& names);

/// A frame's maps and pixels once they were read.
class PyTouch {
 public:
  explicit PyTouch(std::shared_ptr<HeldFrame> held) : held_(std::move(held)) {}

  const Touch& touch() const { return held_->touch(); }
  const HeldFrame& held() const { return *held_; }
  const std::shared_ptr<HeldFrame>& shared() const { return held_; }
  void keep(const Kept& kept);

  pybind11::object depth_mm();
  pybind11::object image();
  pybind11::object confidence();
  pybind11::object pressure_kPa();
  pybind11::object shear_kPa();
  pybind11::object extrapolated();

 private:
  template <typename Read, typename Make>
  pybind11::object once(pybind11::object& kept, const char* name, Read read, Make make);
  void read_traction(const char* name);
  std::vector<pybind11::ssize_t> shape() const { return {held_->format().height, held_->format().width}; }

  std::shared_ptr<HeldFrame> held_;
  pybind11::object depth_, image_, confidence_, pressure_, shear_, extrapolated_;
};

/// Pixels of `frames` frames, one after another, as frames x rows x columns (x 3).
pybind11::object images_of(std::vector<uint8_t> bytes, const FrameFormat& format, pybind11::ssize_t frames);
/// The cells' pixels, row by row, 1: extrapolated; none where there is no map.
std::vector<uint8_t> extrapolated_pixels(const ExtrapolatedCells& map, const FrameFormat& format);

}  // namespace palpate::python

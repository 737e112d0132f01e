// Pictures and video without a window, drawn as in the window.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "palpate/frame.h"
#include "palpate/pipeline.h"
#include "palpate/sensor.h"
#include "viz/panels/section.h"
#include "viz/render/colour_map.h"
#include "viz/render/image/strain_view.h"
#include "viz/render/orbit.h"
#include "viz/render/render_target.h"

namespace palpate::viz {

struct PictureOptions {
  uint32_t width = 1280;  ///< px
  uint32_t height = 720;  ///< px
  float scale = 0;        ///< of text and panels; 0: height / 504, for a picture that is seen 560 px wide
  uint32_t mesh_columns = 256;  ///< at most, on CPU drivers; hardware draws every texel
  double range_mm = 0;          ///< depth with the last colour; 0: follows the touch
  double exaggeration = 0;      ///< of depth; 0: follows the range
  bool lit = true;
  ColourMap map = ColourMap::Viridis;
  Quantity quantity = Quantity::Depth;  ///< that the colours show; Pressure needs the background
  double colour_range = 0;              ///< MPa or strain with the last colour; 0: follows the touch, or 5 %
  SkinStrain skin_strain = SkinStrain::Off;  ///< over the raw image, where the skin is followed
  bool charts = true;
  bool separate = false;  ///< frames are pictures of separate presses: without charts
  double chart_span_s = 10;
  std::optional<SectionLine> section;  ///< with its profile
  bool calibrations = false;           ///< the sensor's, as curves and words over the surface
  Camera camera;
};

/// Draws results off-screen. Keeps its pipelines, so that a recording costs only the drawing.
class PictureRenderer {
 public:
  /// `background`: the untouched image, for Quantity::Pressure; null: depth is shown instead.
  PictureRenderer(gpu::Context& context, const Sensor& sensor, const PictureOptions& options,
                  const Frame* background = nullptr);
  ~PictureRenderer();

  /// Waits for the picture of a frame's `touch` and the maps of `result`; without a surface the raw image is
  /// drawn large. Not thread safe.
  RgbImage render(const Frame& frame, const Touch& touch, const Result& result);
  /// A frame that is measured but not drawn: the charts follow it.
  void follow(const Touch& touch);
  /// Host time of the last picture from submission to fence.
  double draw_ms() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Draws results and drops the pictures, for timing: as the window draws on CPU drivers.
std::function<void(const Frame&, const Result&)> timed_drawer(gpu::Context& context, const Sensor& sensor);

/// Writes atomically (temporary file, then rename). Throws Error(Failure::Output).
void write_png(const RgbImage& image, const std::filesystem::path& file);

/// A film of equally sized pictures: H.264 in .mp4 (VP9 where libx264 is missing), motion JPEG in .avi. The
/// file appears under its name with finish().
class Film {
 public:
  /// Throws Error(Failure::Output) where the file cannot be opened.
  Film(const std::filesystem::path& file, uint32_t width, uint32_t height, double rate_Hz);
  /// Removes an unfinished file.
  ~Film();
  Film(const Film&) = delete;
  Film& operator=(const Film&) = delete;
  void add(const RgbImage& image);
  /// Closes the film and gives it its name. Throws Error(Failure::Output).
  void finish();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace palpate::viz

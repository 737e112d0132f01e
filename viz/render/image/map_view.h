// The growing map of what the pad moves over, from above: heights by colour, in a room of the picture.
#pragma once

#include <vulkan/vulkan.h>

#include <array>
#include <memory>
#include <string>
#include <vector>

#include "capture/run/map/growing_map.h"
#include "palpate/frame.h"
#include "viz/render/colour_map.h"
#include "viz/render/image/image_view.h"
#include "viz/render/map_eye.h"
#include "viz/render/surface_view.h"

struct ImDrawList;

namespace palpate::viz {

struct MapLook {
  std::shared_ptr<const SeenMap> map;         ///< null: there is none yet
  std::vector<std::array<double, 2>> pad_mm;  ///< GrowingMap::pad_mm()
  // Of a map of other values than heights:
  std::string unit = "mm";         ///< of its values
  std::vector<std::string> words;  ///< in place of map_words()'s parts; empty: those
  std::vector<std::vector<std::array<double, 2>>> outlines_mm;  ///< of each thing that was found on it
  std::vector<std::array<double, 2>> next_mm;  ///< corners of where to press next; empty: nowhere
};

/// A map's place in the picture; both axes in one scale.
struct MapFit {
  ViewRect picture;  ///< of the room, without its words
  double px_per_mm = 1;
  double x_mm = 0, y_mm = 0;  ///< in the picture's middle
  bool operator==(const MapFit& other) const;

  std::array<float, 2> at(double x, double y) const;  ///< px of a place, mm
};
MapFit fit_map(const SeenMap* map, const ViewRect& room, const MapEye& eye, float scale);

/// Area, error, key frames and loops, in as few lines as have room in `width_px` of the present font.
std::vector<std::string> map_words(const MapLook& look, float width_px);

/// Words, colour bar, a length in mm, the way of the pad and where it is now, over the picture.
void draw_map_marks(ImDrawList* list, const ViewRect& room, const MapLook& look, const MapEye& eye,
                    ColourMap colours, float scale);

/// Heights of a map in colours, low to high, in 3 planes of 8 bits; where nothing was seen, the ground of
/// charts.
void paint_map(Frame& picture, const SeenMap* map, const MapFit& fit, ColourMap colours);

class MapView {
 public:
  MapView(gpu::Context& context, const RenderPass& pass, uint32_t frames_in_flight)
      : image_(context, pass, frames_in_flight) {}
  /// The picture is made anew where something of it has changed. Once a picture.
  void draw(VkCommandBuffer cmd, VkExtent2D extent, const MapLook& look, const MapFit& fit, ColourMap colours,
            bool light_theme);

 private:
  ImageView image_;
  Frame picture_;
  std::shared_ptr<const SeenMap> painted_;
  MapFit fit_{};
  ColourMap colours_ = ColourMap::Viridis;
  bool light_theme_ = false;
};

}  // namespace palpate::viz

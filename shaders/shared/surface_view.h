// Push constants of the surface view's shaders; 128 bytes, the least that every device takes.
#ifndef PALPATE_SHARED_SURFACE_VIEW_H
#define PALPATE_SHARED_SURFACE_VIEW_H

#ifdef __cplusplus
#include <array>
#include <cstdint>
namespace palpate::viz {
using uint = uint32_t;
using mat4 = std::array<float, 16>;
#endif

// World: mm, origin at rest level in the middle of the pad, x right and y up in the image as a person sees
// it, z out of the pad; depth goes down, multiplied by the exaggeration.
struct SurfacePush {
  mat4 clip_from_world;
  float eye_x_mm;
  float eye_y_mm;
  float eye_z_mm;
  float grid_mm;       // spacing of the lines on the surface; 0: none
  float pitch_mm;      // of one texel of the map
  float exaggeration;  // of depth
  float offset_mm;     // added to a value of the map
  float colour_range;  // value with the last colour: mm of depth, MPa, strain, or shear over pressure
  uint width;          // of the map, texels
  uint height;
  uint row_pitch;  // texels from one row of the buffer to the next
  uint mesh_size;  // vertices, columns in the lower half and rows in the upper
  uint load_size;  // texels of the map of loads, columns in the lower half and rows in the upper
  // Lowest bit 0: plain colours, to be read against the colour bar. Above it the texels from a pixel's own to
  // those its slope is taken from, where it covers several; else 0.
  uint lit_spread;
};

// The raw image in a rectangle of the screen.
struct ImagePush {
  float left;  // of the rectangle in clip space
  float top;
  float right;
  float bottom;
  uint width;  // px of the image
  uint height;
  uint channels;        // 1 or 3 planes
  uint pixel_bytes;     // 1 or 2
  uint taps;            // samples a side averaged for one screen pixel
  float scale;          // 1 / full scale
  float step_px;        // image px covered by one screen pixel
  float strain_range;   // with the last colour; 0: no strain is drawn over the image
  uint strain_pitch;    // texels from one row of the map to the next
  uint strain_step;     // texels of the map along one px of the image
  uint strain_colours;  // the colour map
};

#ifdef __cplusplus
static_assert(sizeof(SurfacePush) == 120);
static_assert(sizeof(ImagePush) == 60);
}  // namespace palpate::viz
#endif
#endif

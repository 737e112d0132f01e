// Perceptually uniform colour maps as polynomials of degree 6, read by GLSL and C++: viridis, cividis and
// magma, largest error 4, 6 and 5 of 255. All three rise steadily in lightness, for colour-blind eyes as
// well; cividis looks the same to most of them.
#ifndef PALPATE_SHARED_COLORMAP_H
#define PALPATE_SHARED_COLORMAP_H

#ifdef __cplusplus
#define PALPATE_INLINE inline
namespace palpate::viz {
#else
#define PALPATE_INLINE
#endif

#define PALPATE_MAP_VIRIDIS 0
#define PALPATE_MAP_CIVIDIS 1
#define PALPATE_MAP_MAGMA 2

// Quantities that the colours of the surface show.
#define PALPATE_SHOWN_DEPTH 0
#define PALPATE_SHOWN_PRESSURE 1
#define PALPATE_SHOWN_STRAIN 2
#define PALPATE_SHOWN_FRICTION 3

// t from 0 (rest) to 1 (deepest); the result is display encoded (sRGB), 0 to 1 within the polynomial's error.
PALPATE_INLINE float viridis_red(float t) {
  return 0.267065f +
         t * (0.230359f +
              t * (-0.787978f + t * (-4.640502f + t * (8.884154f + t * (0.528358f - t * 3.488326f)))));
}
PALPATE_INLINE float viridis_green(float t) {
  return 0.004853f +
         t * (1.399178f +
              t * (0.283356f + t * (-6.209138f + t * (15.203278f + t * (-14.804042f + t * 5.028663f)))));
}
PALPATE_INLINE float viridis_blue(float t) {
  return 0.329455f +
         t * (1.405546f +
              t * (0.426816f + t * (-22.032958f + t * (63.876748f + t * (-73.251645f + t * 29.389875f)))));
}
PALPATE_INLINE float cividis_red(float t) {
  return 0.001972f +
         t * (-1.588428f + t * (29.635596f + t * (-118.635230f +
                                                  t * (214.996899f + t * (-181.076051f + t * 57.683244f)))));
}
PALPATE_INLINE float cividis_green(float t) {
  return 0.135782f +
         t * (0.679748f +
              t * (-0.068438f + t * (0.524292f + t * (-1.086318f + t * (1.084360f - t * 0.362058f)))));
}
PALPATE_INLINE float cividis_blue(float t) {
  return 0.306895f +
         t * (2.517847f +
              t * (-16.408099f + t * (46.404718f + t * (-61.211593f + t * (36.605610f - t * 8.011378f)))));
}
PALPATE_INLINE float magma_red(float t) {
  return -0.007607f +
         t * (0.540652f +
              t * (5.545839f + t * (-16.953842f + t * (32.894880f + t * (-34.399004f + t * 13.376653f)))));
}
PALPATE_INLINE float magma_green(float t) {
  return 0.010874f +
         t * (0.589865f +
              t * (-3.767875f + t * (16.805111f + t * (-34.226795f + t * (35.132444f - t * 13.566640f)))));
}
PALPATE_INLINE float magma_blue(float t) {
  return -0.002379f +
         t * (2.235357f +
              t * (3.694746f + t * (-29.767982f + t * (47.177204f + t * (-28.891386f + t * 6.321558f)))));
}

// `map`: one of PALPATE_MAP_...
PALPATE_INLINE float map_red(int map, float t) {
  return map == PALPATE_MAP_CIVIDIS ? cividis_red(t)
         : map == PALPATE_MAP_MAGMA ? magma_red(t)
                                    : viridis_red(t);
}
PALPATE_INLINE float map_green(int map, float t) {
  return map == PALPATE_MAP_CIVIDIS ? cividis_green(t)
         : map == PALPATE_MAP_MAGMA ? magma_green(t)
                                    : viridis_green(t);
}
PALPATE_INLINE float map_blue(int map, float t) {
  return map == PALPATE_MAP_CIVIDIS ? cividis_blue(t)
         : map == PALPATE_MAP_MAGMA ? magma_blue(t)
                                    : viridis_blue(t);
}

#ifdef __cplusplus
}  // namespace palpate::viz
#endif
#endif

// Viridis as a polynomial of degree 6, largest error 4/255; perceptually uniform, read by GLSL and C++.
#ifndef PALPATE_SHARED_COLORMAP_H
#define PALPATE_SHARED_COLORMAP_H

#ifdef __cplusplus
#define PALPATE_INLINE inline
namespace palpate::viz {
#else
#define PALPATE_INLINE
#endif

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

#ifdef __cplusplus
}  // namespace palpate::viz
#endif
#endif

// Tile of the surface's kernels for GPUs, one workgroup each; read by GLSL and C++.
#ifndef PALPATE_SHARED_TILE_H
#define PALPATE_SHARED_TILE_H

#ifdef __cplusplus
namespace palpate::shared {
#endif

const int kTileWidth = 32, kTileHeight = 16;  // cells of a level; of the slopes px

#ifdef __cplusplus
}  // namespace palpate::shared
#endif
#endif

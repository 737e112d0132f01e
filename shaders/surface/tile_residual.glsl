// Residual of the heights, summed over blocks of two by two cells: the coarser level's right side. `heights` are those of
// the tile with HEIGHTS_HALO cells around it, `right` the right side with RIGHT_HALO. Included after `coarse` (writeonly) is declared.
void put_residual_sums(ivec2 origin) {
  FOR_SHARED(n, kTileWidth * kTileHeight / 4) {
    ivec2 block = ivec2(n % (kTileWidth / 2), n / (kTileWidth / 2)), place = origin / 2 + block;
    float sum = 0.0;
    for (int i = 0; i < 4; ++i) {
      ivec2 inner = 2 * block + ivec2(i & 1, i >> 1), cell = origin + inner;
      int at = index_of(inner, HEIGHTS_HALO);
      float residual = right[index_of(inner, RIGHT_HALO)] - APPLY(cell, heights, at, HEIGHTS_HALO);
      sum += choose(in_frame(cell), residual, 0.0);
    }
    if (place.x < 4 * int(push.coarse_pitch) && place.y < int(push.coarse_height))
      coarse[uint(place.y) * 4 * push.coarse_pitch + uint(place.x)] = sum;
  }
}

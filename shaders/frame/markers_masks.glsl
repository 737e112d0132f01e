// Cells of the markers stage: three colours of 10 bits, 4 times their mean, in rows of 32 * push.words cells; masks have a bit a cell.

uvec3 unpack_cell(uint cell) { return (uvec3(cell) >> uvec3(0, kCellBits, 2 * kCellBits)) & kCellMask; }
uint pack_cell(uvec3 sums) { return sums.x | (sums.y << kCellBits) | (sums.z << 2 * kCellBits); }
int cell_at(ivec2 at) { return at.y * int(32 * push.words) + at.x; }
int word_at(ivec2 at) { return at.y * int(push.words) + (at.x >> 5); }

// All that the multigrid does on its coarsest levels, in one workgroup: what takes a dispatch for each step there leaves a GPU idle.
// FULL: a full-multigrid pass down to the finest of these levels; else a V(2,0) cycle from zero. Either reads that level's right side
// and writes its solution. Levels lie one behind the other in `work`, without padding: of the finest one the solution, of each other
// one the right side and the solution. Sweeps are made in registers, so that a level needs no second solution.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/shared/texels.glsl"
#include "shaders/surface/grid.glsl"
#include "shaders/frame/cubic.glsl"

layout(local_size_x_id = 0, local_size_y_id = 1, local_size_z_id = 2) in;
layout(constant_id = 3) const uint FULL = 1;
layout(push_constant) uniform Push { CoarsePush push; };
TEXELS(0, float, right_words);
TEXELS(1, float, inverse_words);
layout(binding = 2) writeonly buffer Out { float result[]; };
layout(constant_id = 4) const uint WORDS = 1;  // of all levels
layout(constant_id = 5) const uint TURNS = 1;  // an invocation's cells of the finest level
shared float work[WORDS];

#include "shaders/surface/for_shared.glsl"

void next_step() {
  memoryBarrierShared();
  barrier();
}

ivec2 size_of(int level) { return ivec2(push.levels[level].width, push.levels[level].height); }
int cells_of(int level) { return size_of(level).x * size_of(level).y; }
// Where a level begins; its solution lies behind its right side.
int right_at(int level) {
  int at = cells_of(0);
  for (int i = 1; i < level; ++i) at += 2 * cells_of(i);
  return at;
}
int x_at(int level) { return level == 0 ? 0 : right_at(level) + cells_of(level); }
// The right side of cell n; the finest level's stays where it is.
float right_side(int level, int n) {
  int width = size_of(0).x;
  if (level == 0) return texelFetch(right_words, n / width * 4 * int(push.pitch) + n % width).x;
  return work[right_at(level) + n];
}

// The operator of grid.glsl on cell n of what the solution holds.
float apply(int level, int n) {
  CoarseLevel g = push.levels[level];
  int width = int(g.width), height = int(g.height), x = n % width, y = n / width, at = x_at(level) + n;
  float c = work[at], l = work[x > 0 ? at - 1 : at], r = work[x < width - 1 ? at + 1 : at];
  float u = work[y > 0 ? at - width : at], d = work[y < height - 1 ? at + width : at];
  vec2 nearer = 2.0 / (1.0 + vec2(g.edge_width, g.edge_height));
  float left = x == width - 1 ? nearer.x : 1.0, right = x == width - 2 ? nearer.x : 1.0, wide = x == width - 1 ? g.edge_width : 1.0;
  float up = y == height - 1 ? nearer.y : 1.0, down = y == height - 2 ? nearer.y : 1.0, high = y == height - 1 ? g.edge_height : 1.0;
  return high * g.across * (left * (c - l) + right * (c - r)) + g.down * wide * (up * (c - u) + down * (c - d));
}

// An invocation's cells of a level, in registers.
#define FOR_OWN(level)                                                                                 \
  for (int i = 0, n = int(gl_LocalInvocationIndex); i < int(TURNS); ++i, n += int(gl_WorkGroupSize.x)) \
    if (n < cells_of(level))

void put_own(int level, float own[TURNS]) {
  next_step();
  FOR_OWN(level) work[x_at(level) + n] = own[i];
  next_step();
}

float step_of(int level, float root) { return 0.5 / ((push.levels[level].across + push.levels[level].down) * root); }

void sweep(int level, float root) {
  float step = step_of(level, root);
  float own[TURNS];
  FOR_OWN(level) own[i] = work[x_at(level) + n] + step * (right_side(level, n) - apply(level, n));
  put_own(level, own);
}

// Two sweeps from zero: the first is step0 times the right side.
void sweep_from_zero(int level) {
  float step0 = step_of(level, push.root0), step1 = step_of(level, push.root1), own[TURNS];
  FOR_OWN(level) work[x_at(level) + n] = right_side(level, n);
  next_step();
  FOR_OWN(level) {
    float f = work[x_at(level) + n];
    own[i] = step0 * f + step1 * (f - step0 * apply(level, n));
  }
  put_own(level, own);
}

// The coarser level's right side: sums over two by two cells of the right side or, with `residual`, of what x leaves of it.
void restrict_to_coarser(int level, bool residual) {
  ivec2 size = size_of(level), coarse = size_of(level + 1);
  int to = right_at(level + 1);
  FOR_SHARED(n, cells_of(level + 1)) {
    float sum = 0.0;
    for (int i = 0; i < 4; ++i) {
      ivec2 cell = 2 * ivec2(n % coarse.x, n / coarse.x) + ivec2(i & 1, i >> 1);
      bool inside = cell.x < size.x && cell.y < size.y;
      int at = inside ? cell.y * size.x + cell.x : 0;
      float value = right_side(level, at);
      if (residual) value -= apply(level, at);
      sum += inside ? value : 0.0;
    }
    work[to + n] = sum;
  }
  next_step();
}

// The coarsest level, by the inverse of its operator, whose rows are padded to texels. It is symmetric: neighbouring invocations read
// neighbouring words.
void solve_coarsest() {
  int level = int(push.count) - 1, width = size_of(level).x, pitch = (width + 3) / 4 * 4, padded = pitch * size_of(level).y;
  int f = right_at(level), x = x_at(level);
  FOR_SHARED(n, cells_of(level)) {
    int column = n / width * pitch + n % width;
    float sum = 0.0;
    for (int from = 0, row = 0; from < cells_of(level); from += width, row += pitch)
      for (int i = 0; i < width; ++i) sum += texelFetch(inverse_words, (row + i) * padded + column).x * work[f + from + i];
    work[x + n] = sum;
  }
  next_step();
}

// Adds the coarser level's correction, interpolated linearly.
void correct(int level) {
  ivec2 size = size_of(level), coarse = size_of(level + 1), last = coarse - 1;
  vec2 edge = vec2(push.levels[level].edge_width, push.levels[level].edge_height);
  int x = x_at(level), from = x_at(level + 1);
  FOR_SHARED(n, cells_of(level)) {
    ivec2 cell = ivec2(n % size.x, n / size.x), near = cell >> 1, far = clamp(near + 2 * (cell & 1) - 1, ivec2(0), last);
    near = min(near, last);
    float wx = far_weight(cell.x, size.x, edge.x), wy = far_weight(cell.y, size.y, edge.y);
    float here = mix(work[from + near.y * coarse.x + near.x], work[from + near.y * coarse.x + far.x], wx);
    float beyond = mix(work[from + far.y * coarse.x + near.x], work[from + far.y * coarse.x + far.x], wx);
    work[x + n] += mix(here, beyond, wy);
  }
  next_step();
}

// The value at place i of a line of n that begins at `from`, going on linearly beyond its ends.
float line_at(int from, int stride, int i, int n) {
  int at = clamp(i, 0, n - 1), before = clamp(at - sign(i - at), 0, n - 1);
  float here = work[from + at * stride];
  return here + float(abs(i - at)) * (here - work[from + before * stride]);
}

// The same at cell `fine` of the finer level, by cubics.
float line_cubic(int from, int stride, int fine, int n, vec4 w) {
  int near = fine >> 1, away = 2 * (fine & 1) - 1;
  return w.x * line_at(from, stride, near + 2 * away, n) + w.y * line_at(from, stride, near + away, n) +
         w.z * line_at(from, stride, near, n) + w.w * line_at(from, stride, near - away, n);
}

// Starts from the coarser level's heights, interpolated by cubics along its rows and then along columns, and sweeps twice. The rows
// lie where the solution will.
void ascend(int level) {
  CoarseLevel g = push.levels[level];
  ivec2 size = size_of(level), coarse = size_of(level + 1);
  int x = x_at(level), from = x_at(level + 1);
  FOR_SHARED(n, size.x * coarse.y) {
    int column = n % size.x;
    work[x + n] = line_cubic(from + n / size.x * coarse.x, 1, column, coarse.x, cubic(column, size.x, g.edge_width));
  }
  next_step();
  float own[TURNS];
  FOR_OWN(level) {
    int row = n / size.x;
    own[i] = line_cubic(x + n % size.x, size.x, row, coarse.y, cubic(row, size.y, g.edge_height));
  }
  put_own(level, own);
  sweep(level, push.root0);
  sweep(level, push.root1);
}

void cycle(int first) {
  int last = int(push.count) - 1;
  for (int level = first; level < last; ++level) {
    sweep_from_zero(level);
    restrict_to_coarser(level, true);
  }
  solve_coarsest();
  for (int level = last - 1; level >= first; --level) correct(level);
}

void main() {
  int last = int(push.count) - 1;
  ivec2 size = size_of(0);
  if (FULL == 1) {
    for (int level = 0; level < last; ++level) restrict_to_coarser(level, false);
    solve_coarsest();
    for (int level = last - 1; level >= 0; --level) {
      ascend(level);
      if ((push.cycled >> level & 1) == 1) {
        restrict_to_coarser(level, true);
        cycle(level + 1);
        correct(level);
      }
    }
  } else {
    cycle(0);
  }
  // Texels are whole: their last columns repeat the frame's last one.
  int padded = 4 * int(push.pitch), x = x_at(0);
  FOR_SHARED(n, padded * size.y) result[n] = work[x + n / padded * size.x + min(n % padded, size.x - 1)];
}

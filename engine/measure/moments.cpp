#include "engine/measure/moments.h"

namespace palpate {

ContactMoments moved(ContactMoments m, int64_t dx, int64_t dy) {
  const auto area = static_cast<int64_t>(m.area), gray = static_cast<int64_t>(m.gray);
  m.xx += 2 * dx * m.x + dx * dx * area;
  m.yy += 2 * dy * m.y + dy * dy * area;
  m.xy += dx * m.y + dy * m.x + dx * dy * area;
  m.x += dx * area;
  m.y += dy * area;
  m.gray_x += dx * gray;
  m.gray_y += dy * gray;
  return m;
}

}  // namespace palpate

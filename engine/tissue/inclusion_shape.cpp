#include "engine/tissue/inclusion_shape.h"

#include <cstddef>

namespace palpate {

const char* to_string(InclusionShape shape) {
  return kShapeNames[static_cast<size_t>(shape)];
}

}  // namespace palpate

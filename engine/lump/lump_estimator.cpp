#include "engine/lump/lump_estimator.h"

#include "engine/lump/direct_inversion.h"

namespace palpate {

LumpEstimator direct_estimator(uint32_t threads) {
  return [threads](const LumpReading& reading) {
    DirectInversionOptions options;
    options.model.threads = threads;
    return invert_directly(reading, options);
  };
}

}  // namespace palpate

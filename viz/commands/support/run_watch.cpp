#include "viz/commands/support/run_watch.h"
#include "viz/commands/support/progress.h"

#include <memory>

namespace palpate {

RunWatch run_watch(const Common& common) {
  return {interrupted, [&common](const char* what, uint64_t total) -> RunWatch::Progress {
            const auto bar = std::make_shared<ProgressBar>(common, what, total);
            return [bar](uint64_t done) { bar->update(done); };
          }};
}

}  // namespace palpate

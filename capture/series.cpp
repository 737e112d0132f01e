#include "capture/series.h"

#include <cstdint>
#include <memory>

#include "capture/files/frame_range.h"
#include "capture/open_source.h"
#include "engine/pipeline/pipeline_access.h"
#include "engine/sensor/fit.h"
#include "palpate/error.h"

namespace palpate {

// One that cannot be read is the run's to refuse, with all before it measured.
void look_ahead(const std::string& input, const Sensor& sensor, Pipeline& pipeline,
                const std::function<bool()>& stop) {
  constexpr uint64_t kMostPictures = 60;
  if (!shows_flaws(sensor) && !follows_light(sensor)) return;
  try {
    const std::unique_ptr<Source> pictures = open_source(input, sensor);
    if (background_origin(sensor, *pictures) != BackgroundOrigin::File) return;
    const uint64_t count = pictures->frame_count().value_or(0), every = count / kMostPictures + 1;
    Frame picture;
    for (uint64_t n = 0; n < count && !(stop && stop()); n += every)
      if (seek_frame(*pictures, n) && pictures->next(picture)) PipelineAccess::look_ahead(pipeline, picture);
  } catch (const Error&) {
  }
}

}  // namespace palpate

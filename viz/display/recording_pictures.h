// Pictures and a film of a recording as it is processed, looking as the window does.
#pragma once

#include <functional>
#include <memory>

#include "capture/run/processing.h"
#include "viz/display/picture.h"

namespace palpate::viz {

/// Who draws for ProcessRequest::draw.
std::function<std::unique_ptr<RecordingPictures>(gpu::Context&, const PictureSetting&)> recording_pictures(
    const PictureOptions& look);

}  // namespace palpate::viz

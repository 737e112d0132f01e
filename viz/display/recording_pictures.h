// Pictures and a film of a recording as it is processed, drawn as in the window.
#pragma once

#include <functional>
#include <memory>

#include "capture/run/process/processing.h"
#include "viz/display/picture.h"

namespace palpate::viz {

/// The drawing callback for ProcessRequest::draw.
std::function<std::unique_ptr<RecordingPictures>(gpu::Context&, const PictureSetting&)> recording_pictures(
    const PictureOptions& look);

}  // namespace palpate::viz

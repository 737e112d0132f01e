#include "capture/calibrate/photometric/pad_match.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <memory>

#include "capture/calibrate/background.h"
#include "capture/open_source.h"
#include "engine/base/statistics.h"
#include "engine/base/text.h"
#include "palpate/error.h"

namespace palpate {
namespace {

constexpr size_t kEnough = 3;  // pictures, one of which shows kSureShare of the pad

std::string light_text(const PadLight& light, bool coloured) {
  std::string words = text("brightness %+.0f %%", 100 * light.brightness);
  if (coloured)
    words += text(", red %+.0f, green %+.0f, blue %+.0f %%", 100 * light.change[0], 100 * light.change[1],
                  100 * light.change[2]);
  return words;
}

}  // namespace

PadMatch::PadMatch(const Frame& untouched, const Sensor& sensor)
    : untouched_(untouched), sensor_(sensor), check_(untouched.format, sensor.saturation_gray, sensor.pad) {
  check_.set_reference(untouched);
}

bool PadMatch::other_pad(const PadLight& light) {
  return light.share < (other_light(light) ? kSureShare : kLeastShare);
}

bool PadMatch::other_light(const PadLight& light) {
  return std::abs(light.brightness) > kBrightness || light.colour > kColour;
}

std::string PadMatch::look_at(const Frame& frame) {
  // Blocks of one colour and steps are a press's too, where a gel is lit evenly.
  const PictureFault fault = check_.look_at(frame);
  if (fault == PictureFault::ColourOrder || fault == PictureFault::Moved) {
    ++damaged_;
    fault_ = fault;
    return std::string("not as the untouched image: ") + to_string(fault);
  }
  const PadLight& light = lights_.emplace_back(light_between(untouched_, frame, sensor_));
  if (other_pad(light))
    return text("of another pad or camera mode: %.0f %% of it are the untouched image's", 100 * light.share);
  if (other_light(light))
    return "under another light than the untouched image: " +
           light_text(light, untouched_.format.channels == 3);
  return {};
}

bool PadMatch::known_pad() const {
  return lights_.size() < kEnough ||
         std::ranges::any_of(lights_, [](const PadLight& light) { return light.share >= kSureShare; });
}

size_t PadMatch::other_pads() const {
  return known_pad() ? static_cast<size_t>(std::ranges::count_if(lights_, other_pad)) : lights_.size();
}

size_t PadMatch::foreign() const {
  if (!known_pad()) return pictures();
  return damaged_ + static_cast<size_t>(std::ranges::count_if(lights_, [](const PadLight& light) {
           return other_pad(light) || other_light(light);
         }));
}

std::string PadMatch::describe() const {
  const size_t foreign = this->foreign(), pads = other_pads(), lights = foreign - pads - damaged_;
  if (foreign == 0) return {};
  std::string why;
  if (damaged_ >= std::max(pads, lights)) {
    why = to_string(fault_);
  } else if (pads >= lights) {
    std::vector<double> shares;
    for (const PadLight& light : lights_)
      if (!known_pad() || other_pad(light)) shares.push_back(light.share);
    why = text("another pad or camera mode: %.0f %% of a picture are the untouched image's",
               100 * median_in_place(shares));
  } else {
    std::vector<PadLight> off;
    std::ranges::copy_if(lights_, std::back_inserter(off), other_light);
    why = "another exposure, white balance or lamp: " +
          light_text(light_of(off), untouched_.format.channels == 3);
  }
  return text("%zu of %zu pictures do not go with the untouched image (", foreign, pictures()) + why + ")";
}

bool PadMatch::most() const {
  return pictures() > 0 && 2 * foreign() >= pictures();
}

void PadMatch::refuse_most(const std::string& input) const {
  if (!most()) return;
  throw Error(Failure::Input, "pictures of the untouched image's pad, under its light, in " + input,
              describe(),
              "a --background of this pad with the exposure, white balance and camera mode of the presses, "
              "all of them fixed, and no picture cropped, scaled, mirrored or turned");
}

std::string foreign_pictures(const std::string& input, const Sensor& sensor,
                             const std::function<bool(uint64_t)>& more) {
  constexpr uint64_t kMostPictures = 60;
  const std::unique_ptr<Source> source = open_source(input, sensor);
  const Frame untouched = load_background(input, sensor, *source);
  const uint64_t every = source->frame_count().value_or(0) / kMostPictures + 1;
  PadMatch match(untouched, sensor);
  Frame frame;
  for (uint64_t n = 0; source->next(frame) && more(n); ++n)
    if (n % every == 0) match.look_at(frame);
  return match.most() ? match.describe() : std::string();
}

}  // namespace palpate

#include "capture/camera/choose_format.h"

#include <algorithm>
#include <utility>

#include "palpate/error.h"
#include "palpate/sensor.h"

namespace palpate {
namespace {

std::string names_of(const std::vector<OfferedFormat>& offered) {
  std::string list;
  for (const OfferedFormat& format : offered)
    if (format.known) list += (list.empty() ? "" : ", ") + std::string(format.known->name);
  return list.empty() ? "none that can be read" : list;
}

}  // namespace

CameraNeeds needs_of(const Sensor& sensor) {
  CameraNeeds needs{sensor.channels, sensor.bit_depth, {}};
  if (!sensor.crop_px && !sensor.quad_px) needs.size_px = sensor.size_px;
  return needs;
}

std::vector<const PixelFormat*> fitting_formats(const std::vector<OfferedFormat>& offered,
                                                const CameraNeeds& needs) {
  std::vector<std::pair<int, const PixelFormat*>> ranked;
  const bool any_colour = std::any_of(offered.begin(), offered.end(),
                                      [](const auto& o) { return o.known && o.known->channels == 3; });
  for (const OfferedFormat& offer : offered) {
    if (!offer.known) continue;
    const PixelFormat& f = *offer.known;
    const uint32_t channels = needs.channels != 0 ? needs.channels : any_colour ? 3 : 1;
    if (f.channels < channels) continue;
    // 8 bits cannot become more, nor more than 8 become 8.
    if (needs.bit_depth != 0 && (f.bit_depth > 8) != (needs.bit_depth > 8)) continue;
    int rank = 0;
    if (needs.bit_depth == 0) {
      rank -= static_cast<int>(f.bit_depth);
    } else if (f.bit_depth < needs.bit_depth) {
      rank += 100 + static_cast<int>(needs.bit_depth - f.bit_depth);
    } else {
      rank += static_cast<int>(f.bit_depth - needs.bit_depth);
    }
    rank *= 10;
    if (f.layout == PixelLayout::Jpeg) rank += 5;
    if (f.layout == PixelLayout::Bayer8) rank += channels == 1 ? 4 : 1;
    if (f.layout == PixelLayout::Bayer12p || f.layout == PixelLayout::Bayer12Packed)
      rank += channels == 1 ? 5 : 2;
    if (f.layout == PixelLayout::Gray12p || f.layout == PixelLayout::Gray12Packed) rank += 1;
    if (f.layout == PixelLayout::Rgb8 || f.layout == PixelLayout::Bgr8) rank += channels == 1 ? 3 : 2;
    if (f.layout == PixelLayout::Yuyv || f.layout == PixelLayout::Uyvy) rank += channels == 1 ? 2 : 3;
    if (f.layout == PixelLayout::Nv12) rank += 1;
    if (offer.emulated) rank += 6;
    ranked.emplace_back(rank, &f);
  }
  std::stable_sort(ranked.begin(), ranked.end(),
                   [](const auto& a, const auto& b) { return a.first < b.first; });
  std::vector<const PixelFormat*> list;
  list.reserve(ranked.size());
  for (const auto& [rank, format] : ranked) list.push_back(format);
  return list;
}

const PixelFormat& choose_format(const std::vector<OfferedFormat>& offered, const std::string& where,
                                 const CameraOptions& options, const CameraNeeds& needs) {
  if (options.format.empty()) {
    const auto fitting = fitting_formats(offered, needs);
    if (!fitting.empty()) return *fitting.front();
    std::string wanted = "frames";
    if (needs.channels != 0)
      wanted = std::string(needs.channels == 3 ? "colour" : "gray") + " frames of " +
               std::to_string(needs.bit_depth) + " bits";
    throw Error(Failure::Device, wanted + " from " + where, "the formats " + names_of(offered),
                "\"channels\" and \"bit_depth\" in the sensor file that fit the camera");
  }
  const PixelFormat* named = find_pixel_format(options.format);
  if (!named) {
    std::string known;
    for (const PixelFormat& format : pixel_formats())
      known += (known.empty() ? "" : ", ") + std::string(format.name);
    throw Error(Failure::Usage, "a pixel format", "'" + options.format + "'", "one of " + known);
  }
  const bool there = std::any_of(offered.begin(), offered.end(),
                                 [&](const OfferedFormat& format) { return format.known == named; });
  if (!there)
    throw Error(Failure::Device, std::string("format ") + named->name + " from " + where,
                "the formats " + names_of(offered), "one of those");
  if (needs.channels > named->channels)
    throw Error(Failure::Device, "colour from " + where + " (the sensor has 3 channels)",
                std::string("format ") + named->name + ", which is gray", "another of " + names_of(offered));
  return *named;
}

}  // namespace palpate

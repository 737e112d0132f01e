#include "viz/render/image/strain_view.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "engine/base/statistics.h"
#include "engine/gpu/context.h"
#include "viz/render/format.h"

namespace palpate::viz {

const char* to_string(SkinStrain shown) {
  switch (shown) {
    case SkinStrain::Stretch:
      return "stretch";
    case SkinStrain::Shear:
      return "shear";
    default:
      return "off";
  }
}

StrainMap::StrainMap(gpu::Context& context, uint32_t frames_in_flight)
    : context_(context), commands_(context), maps_(frames_in_flight + 1) {}

StrainMap::Map& StrainMap::next_map(const FrameFormat& format, SkinStrain shown) {
  Map& m = maps_[next_++ % maps_.size()];
  if (!m.map || m.width != format.width || m.height != format.height || m.shown != shown) {
    m.texels = {};
    m.map = std::make_unique<PlateMap>(context_, format.width, format.height,
                                       shown == SkinStrain::Shear ? PlateShown::Shear : PlateShown::First);
    m.texels = gpu::TexelView(context_, m.map->map(), VK_FORMAT_R32_SFLOAT);
    m.width = format.width;
    m.height = format.height;
    m.shown = shown;
  }
  return m;
}

const StrainTexels& StrainMap::update(const Touch& touch, const FrameFormat& format, SkinStrain shown) {
  last_ = {};
  std::vector<const SkinPoint*> followed;
  for (const SkinPoint& p : touch.skin_points)
    if (p.correlation > 0) followed.push_back(&p);
  if (!touch.skin || followed.size() < kFewest) {
    last_.missing = touch.skin ? text("%zu of %zu places are followed", followed.size(), kFewest)
                               : "the skin is not followed";
    return last_;
  }
  std::vector<std::array<double, 2>> places, shifts;
  const size_t used = std::min(followed.size(), kMost);
  for (size_t i = 0; i < used; ++i) {
    const SkinPoint& p = *followed[i * followed.size() / used];
    places.push_back({p.rest_x_px, p.rest_y_px});
    shifts.push_back({p.shift_x_px, p.shift_y_px});
  }
  if (field_ && places == places_)
    field_->follow(shifts);
  else
    field_.emplace(places, shifts);
  places_ = std::move(places);
  if (field_->statistics().rank < 2) {
    last_.missing = "the followed places lie in one line";
    return last_;
  }

  Map& m = next_map(format, shown);
  // Between places as far apart as these are on average.
  const double reach_px = 1.5 * std::sqrt(double(format.width) * format.height / static_cast<double>(used));
  m.map->set(field_->spline(), reach_px);
  commands_.begin();
  m.map->record(commands_);
  commands_.host_barrier();
  commands_.end();
  commands_.submit();
  commands_.wait();
  m.map->map().invalidate();
  const auto values = m.map->map().as<float>();
  std::vector<float> sample;
  for (uint32_t y = 4; y < format.height; y += 8)
    for (uint32_t x = 4; x < format.width; x += 8)
      if (const float v = values[size_t{y} * m.map->pitch() + x]; std::isfinite(v)) sample.push_back(v);
  if (!sample.empty()) last_.largest = quantile_in_place(sample, 0.99);
  const bool touched = touch.contact && std::isfinite(touch.centroid_x_px);
  const std::array<double, 2> middle = {touched ? touch.centroid_x_px : 0.5 * format.width,
                                        touched ? touch.centroid_y_px : 0.5 * format.height};
  const MeanStrain there = field_->mean(std::span(&middle, 1));
  last_.sd = shown == SkinStrain::Shear ? there.sd.shear : there.sd.first;
  last_.texels = &m.texels;
  last_.pitch = m.map->pitch();
  return last_;
}

}  // namespace palpate::viz

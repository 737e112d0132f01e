// Places of a mesh's columns and rows over a map: densest where something is to be seen.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "palpate/frame.h"
#include "palpate/touch.h"

namespace palpate::viz {

/// Places of `count` (2 or more) vertices along a side of `texels` texels: increasing, from 0 to texels - 1.
/// Between `from` and `to` they are as dense as the texels, or as seven tenths of them allow; evenly spread
/// elsewhere, and everywhere where that is denser or the span is empty.
std::vector<float> mesh_places(uint32_t texels, uint32_t count, double from, double to);

/// The part of a frame of `width` x `height` px in which a touch dents the surface: around its contacts, with
/// a margin of a quarter of their size. None without a contact.
std::optional<PixelRect> dented_part(const Touch& touch, uint32_t width, uint32_t height);

}  // namespace palpate::viz

// Thumbnails of recent sources: small files next to the window's settings.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "engine/gpu/context.h"
#include "engine/pipeline/surface_map.h"
#include "palpate/frame.h"
#include "viz/panels/settings.h"
#include "viz/render/colour_map.h"
#include "viz/render/render_target.h"

namespace palpate::viz {

inline constexpr uint32_t kThumbnailWidth = 192, kThumbnailHeight = 144;  ///< px

/// The frame in at most `width` x `height` px, each pixel the mean of those that it stands for; smaller
/// frames as they are. Frames of more than 8 bits and gray ones too.
RgbImage scaled_down(const Frame& frame, uint32_t width, uint32_t height);

/// The same in the middle of a dark picture of kThumbnailWidth x kThumbnailHeight.
RgbImage thumbnail_of(const Frame& frame);

/// Depths in a colour map from untouched to `range_mm`, as thumbnail_of; `map`: of the frame's size.
RgbImage depth_thumbnail(gpu::Context& context, const SurfaceMap& map, double offset_mm, ColourMap colours,
                         double range_mm);
/// A simulated touch ("synthetic:...") at its largest force; none of tissue, whose simulation takes seconds.
std::optional<RgbImage> simulated_thumbnail(const std::string& input);

/// Names files by what they are made of; the same on every machine.
uint64_t hash_of(std::string_view words);
/// File of a source's thumbnail, whether it exists or not; empty where nothing is remembered.
std::filesystem::path thumbnail_file(const std::string& input);

/// Writes the thumbnail of `input` and removes those of sources that `settings` no longer remembers. Where it
/// cannot be written there is none.
void keep_thumbnail(const std::string& input, const RgbImage& picture, const Settings& settings);
/// None where there is no such file or it is damaged.
std::optional<RgbImage> load_thumbnail(const std::string& input);

}  // namespace palpate::viz

#include "viz/render/image/image_view.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <span>

#include "engine/gpu/context.h"
#include "shaders/image_frag.spv.h"
#include "shaders/image_vert.spv.h"
#include "shaders/shared/confidence.h"
#include "shaders/shared/surface_view.h"

namespace palpate::viz {

ImageView::ImageView(gpu::Context& context, const RenderPass& pass, uint32_t frames_in_flight)
    : context_(context),
      pipeline_(context, pass, {"raw image", k_image_vert, k_image_frag}, sizeof(ImagePush),
                VK_PRIMITIVE_TOPOLOGY_TRIANGLE_STRIP, false, false, 2),
      uploads_(frames_in_flight),
      nothing_(context, "no strain", sizeof(float) * 4, gpu::Memory::Upload),
      nothing_texels_(context, nothing_, VK_FORMAT_R32_SFLOAT) {
  for (Upload& upload : uploads_) upload.sets = gpu::DescriptorSets(context);
}

namespace {

// Diagonal stripes of mid gray and near black over what is not known. `format`: of the planes, each of whose
// pixels stands for 2^halvings a side of the map's.
template <typename Pixel>
void hatch(std::span<Pixel> planes, const FrameFormat& format, uint32_t halvings, const SurfaceMap& map) {
  constexpr uint32_t kStripe_px = 3;
  const uint32_t light = format.max_gray() / 2, dark = format.max_gray() / 8;
  const uint32_t stripe_px = std::max(1u, kStripe_px >> halvings), middle = (1u << halvings) / 2;
  for (uint32_t y = 0; y < format.height; ++y) {
    const uint16_t* confidence =
        map.confidence.data() + size_t{(y << halvings) + middle} * map.confidence_pitch + middle;
    for (uint32_t x = 0; x < format.width; ++x) {
      if ((confidence[x << halvings] & shared::kFullConfidence) != 0) continue;
      const auto value = static_cast<Pixel>((x + y) / stripe_px % 2 == 0 ? light : dark);
      for (uint32_t c = 0; c < format.channels; ++c)
        planes[(size_t{c} * format.height + y) * format.width + x] = value;
    }
  }
}

// Detail that the picture does not resolve is not uploaded.
void copy_halved(const Frame& frame, uint32_t halvings, const FrameFormat& to, uint8_t* planes) {
  const FrameFormat& from = frame.format;
  const int type = from.bytes_per_pixel() == 2 ? CV_16U : CV_8U;
  const size_t plane_bytes = to.frame_bytes() / to.channels;
  for (uint32_t c = 0; c < from.channels; ++c) {
    // Read only, but OpenCV has no Mat of constant pixels.
    cv::Mat plane(static_cast<int>(from.height), static_cast<int>(from.width), type,
                  const_cast<uint8_t*>(frame.row(c, 0)));
    const cv::Mat out(static_cast<int>(to.height), static_cast<int>(to.width), type,
                      planes + c * plane_bytes);
    for (uint32_t i = 1; i < halvings; ++i) {
      const cv::Size half{plane.cols / 2, plane.rows / 2};
      cv::Mat halved;
      cv::resize(plane(cv::Rect({}, half * 2)), halved, half, 0, 0, cv::INTER_AREA);
      plane = halved;
    }
    if (halvings == 0) {
      plane.copyTo(out);
    } else {
      cv::resize(plane(cv::Rect({}, out.size() * 2)), out, out.size(), 0, 0, cv::INTER_AREA);
    }
  }
}

}  // namespace

void ImageView::draw(VkCommandBuffer cmd, const Frame& frame, const SurfaceMap& map, const ViewRect& rect,
                     VkExtent2D extent, const ImageStrain& strain) {
  constexpr double kFinest_px = 1.5;  // of the image in one of the picture: then it is halved
  FrameFormat format = frame.format;
  uint32_t halvings = 0;
  while (format.width > kFinest_px * rect.width && format.width > 1 && format.height > 1) {
    format.width /= 2;
    format.height /= 2;
    ++halvings;
  }
  Upload& upload = uploads_[next_++ % uploads_.size()];
  upload.sets.reset();
  const bool wide = format.bytes_per_pixel() == 2;
  if (upload.bytes != format.frame_bytes() || upload.wide != wide) {
    upload.texels = {};
    upload.pixels = gpu::DeviceBuffer(context_, "raw image", format.frame_bytes(), gpu::Memory::Upload);
    upload.texels = gpu::TexelView(context_, upload.pixels, wide ? VK_FORMAT_R16_UINT : VK_FORMAT_R8_UINT);
    upload.bytes = format.frame_bytes();
    upload.wide = wide;
  }
  copy_halved(frame, halvings, format, upload.pixels.as<uint8_t>().data());
  if (!map.confidence.empty()) {
    if (wide)
      hatch(upload.pixels.as<uint16_t>(), format, halvings, map);
    else
      hatch(upload.pixels.as<uint8_t>(), format, halvings, map);
  }
  upload.pixels.flush();

  const auto clip = [](double px, uint32_t size) { return static_cast<float>(2 * px / size - 1); };
  const double step_px = static_cast<double>(format.width) / rect.width;
  ImagePush push{};
  push.left = clip(rect.x, extent.width);
  push.top = clip(rect.y, extent.height);
  push.right = clip(rect.x + static_cast<double>(rect.width), extent.width);
  push.bottom = clip(rect.y + static_cast<double>(rect.height), extent.height);
  push.width = format.width;
  push.height = format.height;
  push.channels = format.channels;
  push.pixel_bytes = wide ? 2 : 1;
  push.taps = static_cast<uint32_t>(std::clamp(std::ceil(step_px - 0.25), 1.0, 2.0));
  push.scale = 1.0f / static_cast<float>(format.max_gray());
  push.step_px = static_cast<float>(step_px);

  push.strain_range = strain.texels ? static_cast<float>(strain.range) : 0;
  push.strain_pitch = strain.pitch;
  push.strain_step = 1u << halvings;
  push.strain_colours = static_cast<uint32_t>(strain.map);

  const VkViewport viewport{0, 0, static_cast<float>(extent.width), static_cast<float>(extent.height), 0, 1};
  const VkRect2D scissor{{0, 0}, extent};
  vkCmdSetViewport(cmd, 0, 1, &viewport);
  vkCmdSetScissor(cmd, 0, 1, &scissor);
  const std::array<const gpu::TexelView*, 2> texels{&upload.texels,
                                                    strain.texels ? strain.texels : &nothing_texels_};
  pipeline_.bind(cmd, upload.sets, texels, &push);
  vkCmdDraw(cmd, 4, 1, 0, 0);
}

}  // namespace palpate::viz

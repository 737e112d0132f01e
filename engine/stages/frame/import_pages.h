// Frames in memory that someone else has mapped, such as a camera driver's buffers: the device reads them in
// place and pads them itself, without a copy by the processor.
#pragma once

#include <cstdint>
#include <memory>
#include <mutex>
#include <vector>

#include "engine/base/mapped_pages.h"
#include "engine/gpu/buffer.h"
#include "engine/gpu/kernel.h"
#include "engine/stages/frame/upload.h"
#include "palpate/frame.h"

namespace palpate {
namespace gpu {
class Commands;
class Context;
}  // namespace gpu

/// Mapped pages as a buffer of the device, which is given up with the pages or with its maker, whichever goes
/// first.
class PageImport : public PageUser {
 public:
  /// Empty where the device does not take the pages.
  PageImport(gpu::Context& context, const MappedPages& pages);
  void let_go() noexcept override;

  explicit operator bool() const { return static_cast<bool>(buffer_); }
  const gpu::TexelView& texels() const { return texels_; }  ///< RGBA32UI
  const gpu::TexelView& words() const { return words_; }    ///< R32UI
  uint64_t bytes() const { return buffer_.bytes(); }

 private:
  std::mutex mutex_;
  gpu::DeviceBuffer buffer_;
  gpu::TexelView texels_;
  gpu::TexelView words_;
};

class ImportPages {
 public:
  /// Pages remembered at a time: as many buffers as a V4L2 driver gives.
  static constexpr size_t kMostImports = 32;

  ImportPages(gpu::Context& context, const FrameFormat& format);
  ~ImportPages();
  ImportPages(const ImportPages&) = delete;
  ImportPages& operator=(const ImportPages&) = delete;

  /// The pages in which a leased frame lies, as the device reads them; null where that is not possible (the
  /// frame is then copied). Pages are imported when they are first seen, and those that the device refused
  /// are remembered too. Valid as long as the frame's pages are held.
  const PageImport* find(const Frame& frame);
  /// Device side: as PaddedImage::write, from the imported pages.
  void record(gpu::Commands& commands, const Frame& frame, const PageImport& import,
              const PaddedImage& image) const;

 private:
  struct Known {
    std::weak_ptr<MappedPages> pages;
    std::shared_ptr<PageImport> import;
  };

  gpu::Context& context_;
  FrameFormat format_;
  PaddedLayout layout_;
  gpu::Kernel kernel_;
  std::vector<Known> known_;
};

}  // namespace palpate

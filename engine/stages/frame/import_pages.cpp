#include "engine/stages/frame/import_pages.h"

#include <algorithm>

#include "engine/base/divide_up.h"
#include "engine/gpu/commands.h"
#include "engine/gpu/context.h"
#include "palpate/error.h"
#include "shaders/import_pages.spv.h"
#include "shaders/shared/import_pages.h"

namespace palpate {
namespace {

constexpr uint32_t kWorkgroupSide = 8;

uint32_t groups_along(uint32_t invocations) {
  return divide_up(invocations, kWorkgroupSide);
}

bool same(const std::weak_ptr<MappedPages>& a, const std::shared_ptr<MappedPages>& b) {
  return !a.owner_before(b) && !b.owner_before(a);
}

// Bytes from the pages' beginning to the frame's first pixel.
uint64_t offset_in(const MappedPages& pages, const Frame& frame) {
  return reinterpret_cast<uintptr_t>(frame.pixels()) - reinterpret_cast<uintptr_t>(pages.begin());
}

bool holds(const MappedPages& pages, const Frame& frame) {
  const uint64_t offset = offset_in(pages, frame);  // wraps around where the frame begins before the pages
  return offset <= pages.bytes() && frame.format.frame_bytes() <= pages.bytes() - offset;
}

}  // namespace

PageImport::PageImport(gpu::Context& context, const MappedPages& pages) {
  constexpr uint64_t kMostBytes = uint64_t{1} << 31;  // texels are counted by int, bytes by uint
  if (pages.bytes() > kMostBytes) return;
  try {
    buffer_ = gpu::DeviceBuffer::imported(context, "imported frames", pages.begin(), pages.bytes());
    if (!buffer_) return;
    texels_ = gpu::TexelView(context, buffer_, VK_FORMAT_R32G32B32A32_UINT);
    words_ = gpu::TexelView(context, buffer_, VK_FORMAT_R32_UINT);
  } catch (const Error&) {  // the device's limit on texels, or no memory for the views: a copy will do
    let_go();
  }
}

void PageImport::let_go() noexcept {
  const std::lock_guard lock(mutex_);
  words_ = {};
  texels_ = {};
  buffer_ = {};
}

ImportPages::ImportPages(gpu::Context& context, const FrameFormat& format)
    : context_(context), format_(format), layout_(format) {
  kernel_ = gpu::Kernel(context, {"import_pages", k_import_pages},
                        {{gpu::Binding::Texels, gpu::Binding::Texels, gpu::Binding::Storage},
                         sizeof(shared::PadPush),
                         {kWorkgroupSide, kWorkgroupSide, 1},
                         {}});
}

// While this waits for one that its pages' end has begun to let go, that end waits to unmap.
ImportPages::~ImportPages() {
  for (const Known& known : known_) known.import->let_go();
}

const PageImport* ImportPages::find(const Frame& frame) {
  if (!frame.leased || !frame.pages || !holds(*frame.pages, frame)) return nullptr;
  for (const Known& known : known_)
    if (same(known.pages, frame.pages)) return *known.import ? known.import.get() : nullptr;
  std::erase_if(known_, [](const Known& known) {
    if (!known.pages.expired()) return false;
    known.import->let_go();  // their end may only have begun
    return true;
  });
  if (known_.size() == kMostImports) return nullptr;
  auto import = std::make_shared<PageImport>(context_, *frame.pages);
  known_.push_back({frame.pages, import});
  frame.pages->add_user(import);
  return *import ? import.get() : nullptr;
}

void ImportPages::record(gpu::Commands& commands, const Frame& frame, const PageImport& import,
                         const PaddedImage& image) const {
  const uint32_t rows = format_.height * format_.channels;
  const shared::PadPush push{static_cast<uint32_t>(offset_in(*frame.pages, frame)),
                             static_cast<uint32_t>(format_.row_bytes()), rows, layout_.pitch,
                             static_cast<uint32_t>(format_.bytes_per_pixel())};
  commands.dispatch(kernel_, {&import.texels(), &import.words(), &image.buffer()}, push,
                    {groups_along(layout_.pitch), groups_along(rows), 1});
  commands.barrier();
}

}  // namespace palpate

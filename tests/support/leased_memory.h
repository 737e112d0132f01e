// Memory as a camera driver maps it, from which frames are leased without a camera.
#pragma once

#include <gtest/gtest.h>
#include <sys/mman.h>

#include <atomic>
#include <cstring>
#include <memory>

#include "engine/base/mapped_pages.h"
#include "palpate/frame.h"

namespace palpate {

/// `bytes` of anonymous memory as pages that are unmapped by their last holder; at `address`, where one is
/// given.
inline std::shared_ptr<MappedPages> map_pages(size_t bytes, void* address = nullptr,
                                              std::atomic<int>* unmapped = nullptr) {
  const int fixed = address ? MAP_FIXED_NOREPLACE : 0;
  void* begin = mmap(address, bytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS | fixed, -1, 0);
  if (begin == MAP_FAILED) throw std::bad_alloc();
  return std::make_shared<MappedPages>(static_cast<const uint8_t*>(begin), bytes, [begin, bytes, unmapped] {
    munmap(begin, bytes);
    if (unmapped) ++*unmapped;
  });
}

/// `image` as a frame whose pixels lie `offset` bytes into the pages; `returned` counts leases given back.
inline Frame lease(const Frame& image, const std::shared_ptr<MappedPages>& pages, size_t offset,
                   std::atomic<int>* returned = nullptr) {
  auto* pixels = const_cast<uint8_t*>(pages->begin()) + offset;
  std::memcpy(pixels, image.pixels(), image.format.frame_bytes());
  Frame frame;
  frame.format = image.format;
  frame.sequence = image.sequence;
  frame.time_ns = image.time_ns;
  frame.pages = pages;
  frame.leased = {pixels, [returned](const uint8_t*) {
                    if (returned) ++*returned;
                  }};
  return frame;
}

}  // namespace palpate

// Pages of memory that someone else maps and unmaps, such as a camera driver's buffers, and those who use
// them in place.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <vector>

namespace palpate {

/// Something made from pages that must not outlive them, such as a device's import.
class PageUser {
 public:
  virtual ~PageUser() = default;
  /// The pages go: what was made from them is given up when this returns. Called from whichever thread lets
  /// go of the pages last, perhaps while their user is doing the same, perhaps twice.
  virtual void let_go() noexcept = 0;
};

/// Pages that stay mapped, at the same address, as long as this lives. The one who maps them keeps it in a
/// shared pointer, hands that out with every frame that lies in them (Frame::pages), and drops it where the
/// memory shall go: the last to let go unmaps. Addresses may come back with other pages behind them; this
/// object does not, so what is remembered about pages is remembered by it and never by their address.
class MappedPages {
 public:
  /// `bytes` from `begin` on, both as mmap was given or returned them; `unmap` is called at the end.
  MappedPages(const uint8_t* begin, size_t bytes, std::function<void()> unmap);
  ~MappedPages();
  MappedPages(const MappedPages&) = delete;
  MappedPages& operator=(const MappedPages&) = delete;

  const uint8_t* begin() const { return begin_; }
  /// Whole pages: mmap maps no less.
  size_t bytes() const { return bytes_; }

  /// `user` is notified before the pages are unmapped. Safe from any thread that holds these pages.
  void add_user(const std::weak_ptr<PageUser>& user);

 private:
  const uint8_t* begin_;
  size_t bytes_;
  std::function<void()> unmap_;
  std::mutex mutex_;
  std::vector<std::weak_ptr<PageUser>> users_;
};

}  // namespace palpate

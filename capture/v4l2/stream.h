// Frames straight from a driver's buffers, which are mapped, lent out and given back.
#pragma once

#include <cstdint>
#include <memory>
#include <mutex>
#include <span>
#include <vector>

#include "capture/v4l2/device.h"
#include "engine/base/mapped_pages.h"

namespace palpate::v4l2 {

/// Held in a shared pointer: a lease keeps it alive. After `stop` the camera is free for others, while the
/// pixels that are still lent out stay what they are.
class Stream : public std::enable_shared_from_this<Stream> {
 public:
  /// Starts streaming with `buffers` of them, or as many as the driver gives. Throws Error(Failure::Device).
  static std::shared_ptr<Stream> start(std::shared_ptr<Device> device, uint32_t buffers);
  ~Stream();
  Stream(const Stream&) = delete;
  Stream& operator=(const Stream&) = delete;

  enum class Event {
    Nothing,  ///< the time is over
    Ready,    ///< a buffer may be taken
    Broken,   ///< the stream reports an error: `restart`
    Gone,     ///< the camera is no longer there
  };
  /// Waits for a buffer. A signal ends the wait with Nothing.
  Event wait(int timeout_ms);

  /// A buffer that came back from the driver: ours until `requeue` or the end of its lease.
  struct Filled {
    uint32_t buffer = 0;
    std::span<const uint8_t> bytes;
    uint32_t sequence = 0;
    int64_t stamp_ns = 0;
    bool monotonic = false;       ///< the stamp is of CLOCK_MONOTONIC
    bool start_of_frame = false;  ///< the stamp is of the exposure's start, not of the frame's end
    bool damaged = false;         ///< the driver says that the pixels are not to be trusted
  };
  Event take(Filled& filled);

  /// Hands the buffer back to the driver at once.
  void requeue(uint32_t buffer);
  /// Lends the buffer out: it goes back when the last copy of the pointer is gone, from any thread.
  std::shared_ptr<const uint8_t> lend(uint32_t buffer);
  std::shared_ptr<MappedPages> pages(uint32_t buffer);

  /// Buffers that the driver can fill.
  uint32_t with_driver() const;
  uint32_t buffers() const { return static_cast<uint32_t>(buffers_.size()); }

  /// Stops and starts again with the same buffers; false where the driver refuses.
  bool restart();
  /// Ends streaming and gives up the buffers; those lent out stay mapped until they are back.
  void stop();

 private:
  enum class Owner { Driver, Camera, Lender };
  struct Buffer {
    std::shared_ptr<MappedPages> pages;
    const uint8_t* begin = nullptr;
    size_t bytes = 0;
    Owner owner = Owner::Camera;
  };

  explicit Stream(std::shared_ptr<Device> device) : device_(std::move(device)) {}
  bool queue(uint32_t buffer);
  void queue_all();
  int stream_off();

  std::shared_ptr<Device> device_;
  std::vector<Buffer> buffers_;
  bool stopped_ = false;
  mutable std::mutex mutex_;
};

}  // namespace palpate::v4l2

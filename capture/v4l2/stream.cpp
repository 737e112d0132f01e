#include "capture/v4l2/stream.h"

#include <linux/videodev2.h>
#include <poll.h>
#include <sys/mman.h>

#include <algorithm>
#include <cerrno>

#include "engine/base/readable.h"
#include "palpate/error.h"

namespace palpate::v4l2 {
namespace {

constexpr uint32_t kType = V4L2_BUF_TYPE_VIDEO_CAPTURE;

v4l2_buffer buffer_of(uint32_t index) {
  v4l2_buffer buffer{};
  buffer.type = kType;
  buffer.memory = V4L2_MEMORY_MMAP;
  buffer.index = index;
  return buffer;
}

Error refused(const Device& device, const std::string& what, int error) {
  const Identity& id = device.identity();
  if (error == EBUSY) {
    const std::string who = holders_of(id.path);
    return {Failure::Device, "the camera " + id.path + " (" + id.card + ")",
            "another program using it" + (who.empty() ? "" : ": " + who), "ending that program"};
  }
  const bool bandwidth = error == ENOSPC;  // what USB says when the bus is full
  return {
      Failure::Device, what + " from " + id.path + " (" + id.card + ")",
      bandwidth ? "no bandwidth left on its bus" : system_words(error),
      bandwidth ? "a smaller size, a lower rate, MJPEG, or another port" : "again, or plugging it in anew"};
}

}  // namespace

std::shared_ptr<Stream> Stream::start(std::shared_ptr<Device> device, uint32_t count) {
  std::shared_ptr<Stream> stream(new Stream(std::move(device)));
  const Device& d = *stream->device_;
  v4l2_requestbuffers request{};
  request.count = count;
  request.type = kType;
  request.memory = V4L2_MEMORY_MMAP;
  if (const int error = call(d.file(), VIDIOC_REQBUFS, &request); error != 0)
    throw refused(d, "frame buffers", error);
  if (request.count == 0) throw refused(d, "frame buffers", ENOMEM);
  for (uint32_t i = 0; i < request.count; ++i) {
    v4l2_buffer buffer = buffer_of(i);
    if (const int error = call(d.file(), VIDIOC_QUERYBUF, &buffer); error != 0)
      throw refused(d, "frame buffers", error);
    const size_t bytes = buffer.length;
    void* begin = mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_SHARED, d.file(), buffer.m.offset);
    if (begin == MAP_FAILED) throw refused(d, "mapped frame buffers", errno);
    const auto* pixels = static_cast<const uint8_t*>(begin);
    stream->buffers_.push_back(
        {std::make_shared<MappedPages>(pixels, bytes, [begin, bytes] { munmap(begin, bytes); }), pixels,
         bytes});
  }
  for (uint32_t i = 0; i < request.count; ++i) {
    v4l2_buffer buffer = buffer_of(i);
    if (const int error = call(d.file(), VIDIOC_QBUF, &buffer); error != 0)
      throw refused(d, "frame buffers", error);
    stream->buffers_[i].owner = Owner::Driver;
  }
  uint32_t type = kType;
  if (const int error = call(d.file(), VIDIOC_STREAMON, &type); error != 0) throw refused(d, "frames", error);
  return stream;
}

Stream::~Stream() {
  stop();
}

Stream::Event Stream::wait(int timeout_ms) {
  {
    const std::lock_guard lock(mutex_);
    queue_all();  // what the driver refused to take back before
  }
  pollfd poller{device_->file(), POLLIN, 0};
  const int ready = poll(&poller, 1, timeout_ms);
  if (ready <= 0) return Event::Nothing;  // EINTR: the caller has a look around and comes back
  if (poller.revents & (POLLHUP | POLLNVAL)) return Event::Gone;
  if (poller.revents & POLLIN) return Event::Ready;
  return Event::Broken;
}

Stream::Event Stream::take(Filled& filled) {
  v4l2_buffer buffer = buffer_of(0);
  const int error = call(device_->file(), VIDIOC_DQBUF, &buffer);
  if (error == EAGAIN) return Event::Nothing;
  if (error == ENODEV || error == ENXIO) return Event::Gone;
  if (error != 0 || buffer.index >= buffers_.size()) return Event::Broken;
  const std::lock_guard lock(mutex_);
  Buffer& b = buffers_[buffer.index];
  b.owner = Owner::Camera;
  filled.buffer = buffer.index;
  filled.bytes = {b.begin, std::min<size_t>(buffer.bytesused, b.bytes)};
  filled.sequence = buffer.sequence;
  filled.stamp_ns =
      int64_t{buffer.timestamp.tv_sec} * 1'000'000'000 + int64_t{buffer.timestamp.tv_usec} * 1000;
  filled.monotonic = (buffer.flags & V4L2_BUF_FLAG_TIMESTAMP_MASK) == V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC;
  filled.start_of_frame = (buffer.flags & V4L2_BUF_FLAG_TSTAMP_SRC_MASK) == V4L2_BUF_FLAG_TSTAMP_SRC_SOE;
  filled.damaged = (buffer.flags & V4L2_BUF_FLAG_ERROR) != 0;
  return Event::Ready;
}

bool Stream::queue(uint32_t index) {
  if (stopped_) return false;
  v4l2_buffer buffer = buffer_of(index);
  if (call(device_->file(), VIDIOC_QBUF, &buffer) != 0) return false;
  buffers_[index].owner = Owner::Driver;
  return true;
}

void Stream::queue_all() {
  for (uint32_t i = 0; i < buffers_.size(); ++i)
    if (buffers_[i].owner == Owner::Camera) queue(i);
}

void Stream::requeue(uint32_t index) {
  const std::lock_guard lock(mutex_);
  queue(index);  // where the driver refuses, the next wait tries again
}

std::shared_ptr<const uint8_t> Stream::lend(uint32_t index) {
  const std::lock_guard lock(mutex_);
  buffers_[index].owner = Owner::Lender;
  return {buffers_[index].begin,
          [self = shared_from_this(), pages = buffers_[index].pages, index](const uint8_t*) mutable {
            {
              const std::lock_guard guard(self->mutex_);
              if (!self->stopped_) {
                self->buffers_[index].owner = Owner::Camera;
                self->queue(index);
              }
            }
            pages.reset();
            self.reset();
          }};
}

std::shared_ptr<MappedPages> Stream::pages(uint32_t index) {
  const std::lock_guard lock(mutex_);
  return buffers_[index].pages;
}

uint32_t Stream::with_driver() const {
  const std::lock_guard lock(mutex_);
  return static_cast<uint32_t>(std::count_if(buffers_.begin(), buffers_.end(),
                                             [](const Buffer& b) { return b.owner == Owner::Driver; }));
}

int Stream::stream_off() {
  uint32_t type = kType;
  const int error = call(device_->file(), VIDIOC_STREAMOFF, &type);
  for (Buffer& b : buffers_)
    if (b.owner == Owner::Driver) b.owner = Owner::Camera;
  return error;
}

bool Stream::restart() {
  const std::lock_guard lock(mutex_);
  if (stopped_ || stream_off() != 0) return false;
  queue_all();
  uint32_t type = kType;
  return call(device_->file(), VIDIOC_STREAMON, &type) == 0;
}

void Stream::stop() {
  std::vector<Buffer> old;
  {
    const std::lock_guard lock(mutex_);
    if (stopped_) return;
    stopped_ = true;
    stream_off();
    old.swap(buffers_);
  }
  // First the mappings, since drivers that cannot orphan buffers refuse to free what is mapped; and without
  // the lock, since users of the pages are notified and may be giving back a lease.
  old.clear();
  v4l2_requestbuffers none{};
  none.type = kType;
  none.memory = V4L2_MEMORY_MMAP;
  call(device_->file(), VIDIOC_REQBUFS, &none);
}

}  // namespace palpate::v4l2

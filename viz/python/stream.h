// A stream of measured frames: threads take and measure them, whoever asks gets the next.
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <deque>
#include <exception>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "capture/live/mailbox.h"
#include "capture/run/input.h"
#include "capture/source.h"
#include "engine/gpu/context.h"
#include "palpate/pipeline.h"

namespace palpate::python {

/// A measured frame. Its pixels and maps can be read until expire().
class HeldFrame {
 public:
  /// `truth`: the source, where it knows what was really there; or null. `file`: of this frame alone, or
  /// empty.
  HeldFrame(std::shared_ptr<Pipeline> pipeline, Result result, Frame frame,
            std::shared_ptr<const Source> truth, std::string file);

  const Touch& touch() const { return touch_; }
  const std::string& file() const { return file_; }
  std::optional<Truth> truth() const;
  int64_t exposed_ns() const { return exposed_ns_; }
  const FrameFormat& format() const { return format_; }

  /// Calls `read` with what the frame holds; false once it has expired. Any thread.
  bool read(const std::function<void(const Pipeline&, const Result&, const Frame&)>& read);
  /// Ends that; returns the frame's memory, to use again. Any thread.
  Frame expire();

 private:
  Touch touch_;
  std::shared_ptr<const Source> truth_;
  std::string file_;
  int64_t exposed_ns_;
  FrameFormat format_;
  std::mutex mutex_;
  std::shared_ptr<Pipeline> pipeline_;  ///< null once expired
  Result result_;
  Frame frame_;
};

struct StreamRequest {
  MeasuredInput input;
  SurfaceSolver solver = SurfaceSolver::Live;
  bool fixed_light = false;
  bool one_sequence = false;  ///< images without a rate follow each other
  bool drop = true;           ///< the newest frame wins; recordings then come at their own pace
  double rate_Hz = 0;         ///< of inputs without times
  /// How long a camera that is gone or silent is waited for; then the stream ends with an error.
  double patience_s = 10;
};

class Stream {
 public:
  /// Opens the source and starts; throws what opening does, and ends early once `stop` is set.
  Stream(std::shared_ptr<gpu::Context> device, const StreamRequest& request, const std::atomic<bool>& stop);
  ~Stream();
  Stream(const Stream&) = delete;
  Stream& operator=(const Stream&) = delete;

  std::mutex& mutex() { return mutex_; }
  std::condition_variable& changed() { return changed_; }
  /// Under mutex(): whether take() has an answer.
  bool ready() const { return !results_.empty() || finished_ || closed_; }
  /// Under mutex(): the next frame, null after the last; the one before expires. Rethrows what ended the
  /// stream.
  std::shared_ptr<HeldFrame> take();
  /// Ends threads; the last frame expires. Any thread, any number of times.
  void close();
  bool closed() const { return closed_; }

  const MeasuredInput& input() const { return request_.input; }
  FrameFormat format() const { return source_->format(); }
  double rate_Hz() const { return source_->rate_Hz(); }
  std::optional<uint64_t> frame_count() const { return source_->frame_count(); }
  bool live() const { return source_->live(); }
  bool drops() const { return drops_; }
  uint64_t dropped() const;
  uint64_t delivered() const { return delivered_; }
  std::string warning() const { return source_->warning(); }
  uint64_t damaged() const { return source_->counts().damaged; }
  /// What a camera is waited for; empty: frames come.
  std::string state() const { return source_->state(); }
  std::vector<std::pair<std::string, std::string>> details() const { return source_->details(); }
  const Frame& background() const { return background_; }
  const gpu::Context& device() const { return *device_; }

 private:
  void capture();
  void measure_newest();
  void measure_all();
  void guard(void (Stream::*work)());
  void deliver(Result result, Frame frame);
  Frame empty_frame();
  void reuse(Frame frame);
  void wait_until_due(const Frame& frame);
  bool ending() const { return stopping_; }
  bool out_of_patience();

  StreamRequest request_;
  std::shared_ptr<gpu::Context> device_;
  std::shared_ptr<Source> source_;
  bool has_truth_ = false;
  Frame background_;
  std::shared_ptr<Pipeline> pipeline_;
  bool drops_;
  std::atomic<bool> stopping_ = false, closed_ = false;
  const std::atomic<bool>* opening_ = nullptr;  ///< while the constructor runs: that it is to end
  viz::Mailbox<Frame> newest_;
  std::atomic<uint64_t> delivered_ = 0, passed_over_ = 0;

  mutable std::mutex mutex_;
  std::condition_variable changed_, released_;
  std::deque<std::shared_ptr<HeldFrame>> results_;
  std::shared_ptr<HeldFrame> given_;  ///< the one that was taken last
  std::vector<Frame> spare_;
  bool finished_ = false;
  std::exception_ptr failure_;

  std::chrono::steady_clock::time_point due_;
  int64_t last_time_ns_ = 0;
  bool paced_ = false;
  std::optional<std::chrono::steady_clock::time_point> silent_since_;  ///< of the thread that takes frames
  std::mutex closing_;
  std::vector<std::thread> threads_;
};

}  // namespace palpate::python

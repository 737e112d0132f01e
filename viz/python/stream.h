// A stream of measured frames: a live session whose viewer gives the next frame to whoever asks.
#pragma once

#include <atomic>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "capture/live/recorder.h"
#include "capture/live/session.h"
#include "capture/run/run_settings.h"
#include "capture/source.h"
#include "engine/base/trace.h"
#include "engine/gpu/context.h"
#include "palpate/pipeline.h"
#include "viz/python/handover.h"

namespace palpate::python {

/// A measured frame. Its pixels and maps can be read until expire().
class HeldFrame {
 public:
  /// `truth`: the source, where it knows what was really there; or null. `file`: of this frame alone, or
  /// empty. The pipeline outlives what is not expired.
  HeldFrame(const Pipeline& pipeline, palpate::Measured measured, std::shared_ptr<const Source> truth,
            std::string file);

  const Touch& touch() const { return touch_; }
  const std::string& file() const { return file_; }
  std::optional<Truth> truth() const;
  int64_t exposed_ns() const { return exposed_ns_; }
  const FrameFormat& format() const { return format_; }

  /// Calls `read` with what the frame holds; false once it has expired. Any thread.
  bool read(const std::function<void(const Pipeline&, const Result&, const Frame&)>& read);
  /// Ends that; what it held goes back to the session. Any thread.
  void expire(LiveSession& session);

 private:
  Touch touch_;
  std::shared_ptr<const Source> truth_;
  std::string file_;
  int64_t exposed_ns_;
  FrameFormat format_;
  std::mutex mutex_;
  const Pipeline* pipeline_;  ///< null once expired
  palpate::Measured measured_;
};

/// The trace of a run, or none.
class PythonTrace {
 public:
  /// `file`: empty where there is none. Throws Error(Failure::Output).
  explicit PythonTrace(const std::filesystem::path& file);
  /// Ends it.
  void close() { file_.reset(); }
  /// Why it ended early; empty where it did not. Any thread.
  std::string refusal() const;

 private:
  struct Refusal {
    std::mutex mutex;
    std::string line;
  };
  std::shared_ptr<Refusal> refusal_ = std::make_shared<Refusal>();  // a late thread may still speak
  std::optional<TraceFile> file_;
};

/// Settings that count: those of measuring, `rate_Hz` of inputs without times, and how long a camera is
/// waited for.
struct StreamRequest : RunSettings {
  MeasuredInput found;           ///< find_input() of the settings
  bool drop = true;              ///< the newest frame wins; recordings then come at their own pace
  std::filesystem::path record;  ///< folder of the session to write meanwhile; empty: none
  std::filesystem::path trace;   ///< file of what each thread does when; empty: none
  std::string device;            ///< as shared_device() takes it
};

class Stream : public Handover<HeldFrame> {
 public:
  /// Opens source and device and starts; throws what opening does, and ends early once `stop` is set.
  Stream(const StreamRequest& request, const std::atomic<bool>& stop);
  ~Stream() override;
  void close() final;

  const MeasuredInput& input() const { return request_.found; }
  FrameFormat format() const { return source_->format(); }
  double rate_Hz() const { return source_->rate_Hz(); }
  std::optional<uint64_t> frame_count() const { return source_->frame_count(); }
  bool live() const { return source_->live(); }
  bool drops() const { return drops_; }
  uint64_t dropped() const;
  /// A line of a log beside what is recorded. Throws Refusal where nothing is.
  void log(const std::string& name, std::string_view line) {
    log_to(recording_ ? &*recording_ : nullptr, name, line);
  }
  /// Of the source, else why the trace ended early; empty where all is well.
  std::string warning() const;
  uint64_t damaged() const { return source_->counts().damaged; }
  /// Reason to wait for a camera; empty: frames come.
  std::string state() const { return source_->state(); }
  std::vector<std::pair<std::string, std::string>> details() const { return source_->details(); }
  std::string device_name() const;
  /// Times that the device was lost and opened anew.
  uint32_t device_losses() const { return session_.device_losses; }
  /// The session that is written or was; none where none was asked for.
  std::optional<Recording::Written> recorded() const;

 private:
  class Viewer;

  void run(const Frame& background, const PipelineOptions& pipeline);
  void hand_over(const Pipeline& pipeline);
  void offer(const Pipeline& pipeline, palpate::Measured measured);
  void expire(HeldFrame& frame) override { frame.expire(session_); }
  void expire_all();
  gpu::Context& reopen_device();

  StreamRequest request_;
  PythonTrace trace_;
  LiveSession session_;
  std::shared_ptr<Source> source_;
  bool has_truth_ = false;
  bool drops_ = false;
  std::optional<Recording> recording_;
  std::shared_ptr<gpu::Context> device_;
  bool started_ = false;

  std::mutex closing_;
  std::thread thread_;
};

}  // namespace palpate::python

#include "viz/python/stream.h"

#include "capture/live/live.h"
#include "capture/open_source.h"
#include "capture/run/record_session.h"
#include "palpate/error.h"
#include "viz/python/device.h"
#include "viz/python/errors.h"

namespace palpate::python {
namespace {

using std::chrono::milliseconds;

/// One at the reader's, one that waits for it, one that waits for that place, one in flight.
constexpr uint32_t kSlots = 4;
constexpr milliseconds kShort{20};

}  // namespace

PythonTrace::PythonTrace(const std::filesystem::path& file) {
  if (file.empty()) return;
  file_.emplace(file, [refusal = refusal_](const std::string& line) {
    const std::lock_guard lock(refusal->mutex);
    refusal->line = line;
  });
}

std::string PythonTrace::refusal() const {
  const std::lock_guard lock(refusal_->mutex);
  return refusal_->line;
}

HeldFrame::HeldFrame(const Pipeline& pipeline, palpate::Measured measured,
                     std::shared_ptr<const Source> truth, std::string file)
    : touch_(std::move(measured.result.touch)),
      truth_(std::move(truth)),
      file_(std::move(file)),
      exposed_ns_(measured.captured->frame.exposed_ns),
      format_(measured.captured->frame.format),
      pipeline_(&pipeline),
      measured_(std::move(measured)) {
  measured_.result.touch.surface = touch_.surface;  // where a map's rest level is
  measured_.result.touch.confidence = touch_.confidence;
}

bool HeldFrame::read(const std::function<void(const Pipeline&, const Result&, const Frame&)>& read) {
  const std::lock_guard lock(mutex_);
  if (!pipeline_) return false;
  read(*pipeline_, measured_.result, measured_.captured->frame);
  return true;
}

std::optional<Truth> HeldFrame::truth() const {
  return truth_ ? truth_->truth(touch_.sequence) : std::nullopt;
}

void HeldFrame::expire(LiveSession& session) {
  const std::lock_guard lock(mutex_);
  if (!std::exchange(pipeline_, nullptr)) return;
  session.give_back(measured_);
}

/// Gives what is measured on one device to the reader; what it has of it expires with that device.
class Stream::Viewer : public LiveViewer {
 public:
  Viewer(Stream& stream, const Pipeline& pipeline) : stream_(stream), pipeline_(pipeline) {}
  ~Viewer() override { stream_.expire_all(); }
  LiveReport run() override {
    stream_.hand_over(pipeline_);
    return {};
  }

 private:
  Stream& stream_;
  const Pipeline& pipeline_;
};

Stream::Stream(const StreamRequest& request, const std::atomic<bool>& stop)
    : request_(request), trace_(request.trace), session_(Patience(request.patience_s, request.found.input)) {
  device_ = shared_device(request.device);
  const MeasuredInput& input = request_.found;
  source_ = open_source(input.input, input.sensor);
  PipelineOptions pipeline = pipeline_options(request_, input.outputs, *source_);
  pipeline.slots = kSlots;
  Patience opening(request.patience_s, input.input);
  source_->watch([&] { return stop || opening.over(*source_); });
  const Frame background = load_background(input.input, input.sensor, *source_);
  has_truth_ = source_->truth(0).has_value();
  // Without times there is no pace, and nothing to miss.
  drops_ = request_.drop && (source_->live() || source_->rate_Hz() > 0 || request_.rate_Hz > 0);
  if (!request_.record.empty()) {
    recording_.emplace([this] { return request_.record; },
                       session_info(input, *source_, background, pipeline, *device_),
                       SessionOptions{.no_drop = !drops_});
    recording_->take(open_logs(request_.logs));
    recording_->watch([this] { return session_.stop.load(); });
    recording_->start();
  }
  thread_ = std::thread([this, background, pipeline] { run(background, pipeline); });
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [this] { return started_ || finished_; });
  if (started_ || !failure_) return;
  const std::exception_ptr failure = failure_;
  lock.unlock();
  close();
  std::rethrow_exception(failure);
}

Stream::~Stream() {
  close();
}

void Stream::close() {
  const std::lock_guard closing(closing_);
  {
    const std::lock_guard lock(mutex_);
    session_.stop = true;
    closed_ = true;
  }
  changed_.notify_all();
  released_.notify_all();
  if (thread_.joinable()) thread_.join();
  trace_.close();
  session_.frames.take_all();
  session_.to_engine.take(milliseconds(0));
  session_.to_display.take(milliseconds(0));
}

uint64_t Stream::dropped() const {
  return session_.to_engine.displaced() + session_.to_display.displaced() + session_.passed_over +
         passed_over_ + source_->counts().lost;
}

std::string Stream::warning() const {
  const std::string of_source = source_->warning();
  return of_source.empty() ? trace_.refusal() : of_source;
}

std::string Stream::device_name() const {
  const std::lock_guard lock(mutex_);
  return device_->report().name;
}

std::optional<Recording::Written> Stream::recorded() const {
  return recording_ ? std::optional(recording_->latest()) : std::nullopt;
}

/// The session, on a thread of its own; the reader gets its error after the frames before it.
void Stream::run(const Frame& background, const PipelineOptions& pipeline) {
  name_trace_thread("stream");
  LiveOptions options;
  options.input = request_.found.input;
  options.measure_all = options.show_all = options.unpaced = !drops_;
  options.outlive_device = drops_;  // else frames would be missing
  // Without times of its own the source has those of the rate that was given.
  if (source_->rate_Hz() <= 0) options.rate_Hz = options.times_at_Hz = request_.rate_Hz;
  options.recording = recording_ ? &*recording_ : nullptr;
  options.reopen_device = [this](gpu::Context&) -> gpu::Context& { return reopen_device(); };
  const MeasuredRun run{request_.found.sensor, background, pipeline};
  try {
    run_session(
        session_, *device_, [this] { return source_; }, run, options,
        [this](LiveSession&, LatencyLog&, const Pipeline& on) {
          {
            const std::lock_guard lock(mutex_);
            started_ = true;
          }
          changed_.notify_all();
          return std::make_unique<Viewer>(*this, on);
        });
    if (!drops_ && !closed_ && source_->cut_short())
      throw Error(
          Failure::Input,
          std::to_string(source_->frame_count().value_or(0)) + " frames in '" + request_.found.input + "'",
          "fewer: the file is damaged or cut short", "copying it again");
    if (recording_) recording_->finish();
    if (const auto written = recorded(); written && !written->status.error.empty())
      throw Error(Failure::Output, "a session in '" + request_.record.string() + "'", written->status.error,
                  "another folder");
  } catch (const DeviceLost&) {
    forget_device(*device_);
    fail();
  } catch (...) {
    fail();
  }
  finish();
}

gpu::Context& Stream::reopen_device() {
  forget_device(*device_);
  std::shared_ptr<gpu::Context> anew = shared_device(request_.device);
  const std::lock_guard lock(mutex_);
  device_ = std::move(anew);
  return *device_;
}

void Stream::hand_over(const Pipeline& pipeline) {
  while (!session_.ending()) {
    if (recording_ && !recording_->latest().status.error.empty()) return;
    {
      std::unique_lock lock(mutex_);
      const bool over = session_.to_display.finished();
      // The last frame can be read until the next one is asked for.
      if (over && results_.empty() && !given_) return;
      if (over || (!drops_ && !results_.empty())) {
        released_.wait_for(lock, kShort);
        continue;
      }
    }
    if (auto measured = session_.to_display.take(kShort)) offer(pipeline, std::move(*measured));
  }
}

void Stream::offer(const Pipeline& pipeline, palpate::Measured measured) {
  const TraceSpan span("offer");
  std::string file = source_->frame_name(measured.result.touch.sequence);
  auto held = std::make_shared<HeldFrame>(pipeline, std::move(measured), has_truth_ ? source_ : nullptr,
                                          std::move(file));
  {
    const std::lock_guard lock(mutex_);
    offer_newest(std::move(held));
  }
  changed_.notify_all();
}

void Stream::expire_all() {
  const std::lock_guard lock(mutex_);
  for (const std::shared_ptr<HeldFrame>& result : results_) result->expire(session_);
  if (session_.device_lost) passed_over_ += results_.size();
  results_.clear();
  if (given_) given_->expire(session_);
}

}  // namespace palpate::python

#include "viz/python/stream.h"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "capture/clock.h"
#include "capture/open_source.h"
#include "palpate/error.h"
#include "viz/python/errors.h"

namespace palpate::python {
namespace {

using Clock = std::chrono::steady_clock;
using std::chrono::milliseconds;

/// One at the reader's, one that waits for it, two in flight.
constexpr uint32_t kSlots = 4;
constexpr milliseconds kShort{20};

}  // namespace

HeldFrame::HeldFrame(std::shared_ptr<Pipeline> pipeline, Result result, Frame frame,
                     std::shared_ptr<const Source> truth, std::string file)
    : touch_(std::move(result.touch)),
      truth_(std::move(truth)),
      file_(std::move(file)),
      exposed_ns_(frame.exposed_ns),
      format_(frame.format),
      pipeline_(std::move(pipeline)),
      result_(std::move(result)),
      frame_(std::move(frame)) {
  result_.touch.surface = touch_.surface;  // where a map's rest level is
  result_.touch.confidence = touch_.confidence;
}

bool HeldFrame::read(const std::function<void(const Pipeline&, const Result&, const Frame&)>& read) {
  const std::lock_guard lock(mutex_);
  if (!pipeline_) return false;
  read(*pipeline_, result_, frame_);
  return true;
}

std::optional<Truth> HeldFrame::truth() const {
  return truth_ ? truth_->truth(touch_.sequence) : std::nullopt;
}

Frame HeldFrame::expire() {
  const std::lock_guard lock(mutex_);
  result_ = Result();
  pipeline_.reset();
  frame_.give_back();
  return std::exchange(frame_, Frame());
}

Stream::Stream(std::shared_ptr<gpu::Context> device, const StreamRequest& request,
               const std::atomic<bool>& stop)
    : request_(request), device_(std::move(device)), opening_(&stop) {
  const MeasuredInput& input = request_.input;
  source_ = open_source(input.input, input.sensor);
  source_->watch([this] { return stopping_ || (opening_ && *opening_) || out_of_patience(); });
  background_ = load_background(input.input, input.sensor, *source_);
  pipeline_ = std::make_shared<Pipeline>(
      *device_, for_rectified_frames(input.sensor), source_->format(),
      PipelineOptions{.outputs = input.outputs,
                      .solver = request_.solver,
                      .slots = kSlots,
                      .fixed_light = request_.fixed_light,
                      .separate = separate_presses(*source_, request_.one_sequence, request_.rate_Hz)});
  pipeline_->set_background(background_);
  opening_ = nullptr;
  has_truth_ = source_->truth(0).has_value();
  // Without times there is no pace, and nothing to miss.
  drops_ = request_.drop && (source_->live() || source_->rate_Hz() > 0 || request_.rate_Hz > 0);
  if (drops_) {
    threads_.emplace_back([this] { guard(&Stream::capture); });
    threads_.emplace_back([this] { guard(&Stream::measure_newest); });
  } else {
    threads_.emplace_back([this] { guard(&Stream::measure_all); });
  }
}

Stream::~Stream() {
  close();
}

void Stream::close() {
  const std::lock_guard closing(closing_);
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
    closed_ = true;
  }
  changed_.notify_all();
  released_.notify_all();
  newest_.close();
  for (std::thread& thread : threads_) thread.join();
  threads_.clear();
  const std::lock_guard lock(mutex_);
  for (const std::shared_ptr<HeldFrame>& result : results_) result->expire();
  results_.clear();
  if (given_) given_->expire();
  given_.reset();
  spare_.clear();
  pipeline_.reset();
}

uint64_t Stream::dropped() const {
  return newest_.displaced() + passed_over_ + source_->counts().lost;
}

std::shared_ptr<HeldFrame> Stream::take() {
  if (given_) reuse(given_->expire());
  given_.reset();
  released_.notify_all();
  if (closed_)
    throw Refusal{"ExpiredError", "an open stream", "a closed one",
                  "reading within `with palpate.open(...)`"};
  if (results_.empty()) {
    if (failure_) std::rethrow_exception(std::exchange(failure_, nullptr));
    return nullptr;
  }
  given_ = std::move(results_.front());
  results_.pop_front();
  ++delivered_;
  return given_;
}

/// What a thread does, until its end or an error, which the reader gets after the frames before it.
void Stream::guard(void (Stream::*work)()) {
  try {
    (this->*work)();
  } catch (...) {
    const std::lock_guard lock(mutex_);
    if (!failure_) failure_ = std::current_exception();
  }
  newest_.close();
  if (work != &Stream::capture) {
    const std::lock_guard lock(mutex_);
    finished_ = true;
  }
  changed_.notify_all();
}

/// Under mutex_.
void Stream::reuse(Frame frame) {
  if (!frame.bytes.empty()) spare_.push_back(std::move(frame));
}

Frame Stream::empty_frame() {
  const std::lock_guard lock(mutex_);
  if (spare_.empty()) return {};
  Frame frame = std::move(spare_.back());
  spare_.pop_back();
  return frame;
}

/// Asked while a frame is waited for: whether a camera has been gone too long, which then ends the stream.
bool Stream::out_of_patience() {
  const std::string state = source_->state();
  if (state.empty()) {
    silent_since_.reset();
    return false;
  }
  const Clock::time_point now = Clock::now();
  if (!silent_since_) silent_since_ = now;
  if (std::chrono::duration<double>(now - *silent_since_).count() < request_.patience_s) return false;
  const std::lock_guard lock(mutex_);
  if (!failure_)
    failure_ = std::make_exception_ptr(
        Error(Failure::Device, "frames of " + request_.input.input, state.substr(0, state.find(';')),
              "plugging the camera in again and opening it anew, or a longer patience_s"));
  return true;
}

/// A recording's frames come when they came.
void Stream::wait_until_due(const Frame& frame) {
  if (source_->live()) return;
  const double rate_Hz = source_->rate_Hz() > 0 ? source_->rate_Hz() : request_.rate_Hz;
  const auto period = std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(1 / rate_Hz));
  const int64_t since_ns = frame.time_ns - last_time_ns_;
  const Clock::time_point now = Clock::now();
  due_ = paced_ ? due_ + (since_ns > 0 ? std::chrono::nanoseconds(since_ns) : period) : now;
  due_ = std::max(due_, now - period);  // no catching up with a slow source
  last_time_ns_ = frame.time_ns;
  paced_ = true;
  while (!ending() && Clock::now() < due_)
    std::this_thread::sleep_until(std::min(due_, Clock::now() + kShort));
}

void Stream::capture() {
  while (!ending()) {
    Frame frame = empty_frame();
    frame.after_gap = false;
    frame.exposed_ns = frame.delivered_ns = 0;
    if (!source_->next(frame)) return;
    wait_until_due(frame);
    if (std::optional<Frame> displaced = newest_.put(std::move(frame))) {
      displaced->give_back();
      const std::lock_guard lock(mutex_);
      reuse(std::move(*displaced));
    }
  }
}

void Stream::measure_newest() {
  while (!ending() && !newest_.finished()) {
    std::optional<Frame> frame = newest_.take(kShort);
    if (!frame) continue;
    while (!pipeline_->submit(*frame)) {  // every slot is held by frames that wait to be taken
      std::unique_lock lock(mutex_);
      released_.wait_for(lock, kShort);
      if (ending()) return;
    }
    deliver(*pipeline_->wait(), std::move(*frame));
  }
}

void Stream::measure_all() {
  std::deque<Frame> in_flight;
  const auto finish = [&](std::optional<Result> result) {
    if (!result) return false;
    deliver(std::move(*result), std::move(in_flight.front()));
    in_flight.pop_front();
    return true;
  };
  const auto finish_all = [&] {
    while (!ending() && finish(pipeline_->wait())) {
    }
  };
  try {
    while (!ending()) {
      Frame frame = empty_frame();
      frame.after_gap = false;
      frame.exposed_ns = frame.delivered_ns = 0;
      if (!source_->next(frame)) break;
      while (!pipeline_->submit(frame)) {
        if (finish(pipeline_->wait())) continue;
        std::unique_lock lock(mutex_);
        released_.wait_for(lock, kShort);
        if (ending()) return;
      }
      in_flight.push_back(std::move(frame));
      // The next frame of a camera may be long in coming.
      while (finish(source_->live() ? pipeline_->wait() : pipeline_->poll())) {
      }
    }
  } catch (const Error& error) {
    // A recording damaged at frame n still has n good frames.
    if (error.failure() == Failure::Input) finish_all();
    throw;
  }
  finish_all();
  if (!ending() && source_->cut_short())
    throw Error(
        Failure::Input,
        std::to_string(source_->frame_count().value_or(0)) + " frames in '" + request_.input.input + "'",
        "fewer: the file is damaged or cut short", "copying it again");
}

void Stream::deliver(Result result, Frame frame) {
  if (source_->rate_Hz() <= 0 && request_.rate_Hz > 0)
    result.touch.time_ns = std::llround(static_cast<double>(result.touch.sequence) / request_.rate_Hz * 1e9);
  std::string file = source_->frame_name(result.touch.sequence);
  auto held = std::make_shared<HeldFrame>(pipeline_, std::move(result), std::move(frame),
                                          has_truth_ ? source_ : nullptr, std::move(file));
  {
    const std::lock_guard lock(mutex_);
    if (drops_ && !results_.empty()) {
      reuse(results_.front()->expire());
      results_.pop_front();
      ++passed_over_;
    }
    results_.push_back(std::move(held));
  }
  changed_.notify_all();
}

}  // namespace palpate::python

// A stream of two fingers: pairs of measured frames, and frames without a partner, for whoever asks.
#pragma once

#include <array>
#include <deque>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <thread>

#include "capture/pair/pair_meter.h"
#include "capture/pair/pair_recording.h"
#include "capture/pair/pair_session.h"
#include "viz/python/handover.h"
#include "viz/python/stream.h"

namespace palpate::python {

/// A row of pairs.csv with the frames that it is of.
struct HeldPair {
  GripFrame row;
  std::array<std::shared_ptr<HeldFrame>, 2> of;  ///< left, right; null: the other one is alone
};

/// Settings that count of the fingers: as those of StreamRequest. `out`: the session to write meanwhile;
/// empty: none.
struct PairStreamRequest : PairRequest {
  std::filesystem::path recorded;  ///< folder of a pair, in place of inputs; empty: none
  bool drop = true;                ///< as StreamRequest has it
  std::filesystem::path trace;
  std::string device;
};

class PairStream : public Handover<HeldPair> {
 public:
  /// Opens inputs and device and starts; throws what opening does, and ends early once `stop` is set.
  PairStream(const PairStreamRequest& request, const std::atomic<bool>& stop);
  ~PairStream() override;
  void close() final;

  const MeasuredInput& input(Side side) const { return pair_->fingers[index(side)].found; }
  bool live() const;
  bool drops() const { return drops_; }
  /// Frames of both that nobody got.
  uint64_t dropped() const;
  /// Why a finger gives no frames at present; empty: all is well.
  std::string state() const;
  std::string warning() const { return trace_.refusal(); }
  std::string device_name() const;
  uint32_t device_losses() const { return device_losses_; }
  std::optional<PairRecording::Written> recorded() const;
  /// A line of a log beside what is recorded. Throws Refusal where nothing is.
  void log(const std::string& name, std::string_view line) {
    log_to(recording_ ? &*recording_ : nullptr, name, line);
  }

 private:
  class Viewer;
  /// What is at hand of one finger. Under mutex().
  struct Finger {
    LiveSession* session = nullptr;               ///< while it runs
    std::deque<std::shared_ptr<HeldFrame>> held;  ///< frames whose row is not decided yet
    uint64_t dropped = 0;                         ///< of it once it is over
    std::string state;
    bool started = false;
  };

  void run();
  PairFinger finger(Side side);
  gpu::Context& reopen_device();
  void expire(HeldPair& pair) override;
  bool ending() const;
  bool wants_none(Side side) const;
  void hand_over(Side side, LiveSession& session, const Pipeline& pipeline);
  void add_row(const Matched<FingerTouch>& pair);
  void match_rows();
  bool take_frames(HeldPair& pair, bool& missed);
  void leave(Side side);

  PairStreamRequest request_;
  PythonTrace trace_;
  RunWatch watch_;
  std::optional<OpenPair> pair_;
  std::array<bool, 2> has_truth_{};
  bool drops_ = false;
  std::optional<PairMeter> meter_;
  std::optional<PairRecording> recording_;
  std::atomic<uint32_t> device_losses_ = 0;

  std::shared_ptr<gpu::Context> device_;
  std::array<Finger, 2> fingers_;
  std::deque<GripFrame> rows_;  ///< decided, frames not at hand yet

  std::mutex closing_;
  std::thread thread_;
};

}  // namespace palpate::python

// Results of `palpate profile` for one device, as plain data, and their JSON file.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "engine/base/json.h"

namespace palpate::perf {

/// Version of profile.json; a file of another version is refused.
inline constexpr int kProfileVersion = 1;

/// Samples of one duration. With few samples the outer percentiles are the outermost samples.
struct Distribution {
  uint64_t samples = 0;
  double min_ms = 0;
  double q25_ms = 0;
  double median_ms = 0;
  double q75_ms = 0;
  double p95_ms = 0;
  double p99_ms = 0;
  double max_ms = 0;
};

/// counts[i] samples lie in [edges_ms[i], edges_ms[i + 1]); the edges grow by a constant factor.
struct Histogram {
  std::vector<double> edges_ms;
  std::vector<uint64_t> counts;
};

struct Machine {
  std::string device;
  std::string device_type;
  std::string driver;
  std::string vulkan;
  uint64_t device_memory_bytes = 0;
  std::string cpu;
  uint32_t cpu_threads = 0;
  uint64_t memory_bytes = 0;
  std::string system;    ///< kernel and processor family
  std::string compiler;  ///< that built the program
  std::string palpate;   ///< version of the program
  std::string libraries;
  std::string date_utc;
};

/// Bytes read plus bytes written a second, of work that does nothing else.
struct CeilingPoint {
  uint64_t buffer_bytes = 0;
  double copy_GB_per_s = 0;    ///< vkCmdCopyBuffer
  double stream_GB_per_s = 0;  ///< a kernel that adds one to each float
};
struct Ceiling {
  std::vector<CeilingPoint> points;  ///< growing buffers; the small ones fit into caches
  double GB_per_s = 0;               ///< of the largest buffer, the better of the two
  std::string clock;                 ///< "GPU" or "host": which one times stages on this device
  double clock_ratio =
      0;  ///< GPU time over host time, less the submission, of the same copy; 0 where there is no GPU clock
  double submit_ms = 0;  ///< an empty submission and the wait for it, host clock
};

/// One stage of the pipeline at one size.
struct StageFigure {
  std::string stage;
  Distribution time;
  uint64_t read_bytes = 0;
  uint64_t written_bytes = 0;
  uint32_t dispatches = 0;
  double GB_per_s = 0;          ///< achieved: bytes over the median time
  double ceiling_fraction = 0;  ///< of Ceiling::GB_per_s; above 1 where a cache holds the frame
};

/// The whole frame and its stages at one size, a tenth of it touched, SurfaceSolver::Live.
struct SizeFigure {
  std::string reading;
  uint32_t width_px = 0;
  uint32_t height_px = 0;
  Distribution latency;  ///< of Pipeline::process, host clock, no timers
  Histogram histogram;   ///< of the same samples
  double cpu_ms = 0;     ///< median CPU time of the process in one frame, all threads, the driver's included
  double frames_per_s = 0;  ///< with three frames in flight; median of blocks between the single frames
  uint64_t memory_bytes = 0;
  double setup_ms = 0;  ///< building the pipeline
  std::vector<StageFigure> stages;
  uint64_t pixels() const { return uint64_t{width_px} * height_px; }
};

/// time = constant * pixels^exponent.
struct Growth {
  std::string reading;
  std::string stage;
  double exponent = 0;
  double exponent_standard_error = 0;
  uint64_t from_px = 0;  ///< frames with fewer pixels are left out: fixed costs rule there
  uint32_t sizes = 0;
};

/// One way to solve for the surface on one truth.
struct SolverFigure {
  std::string truth;
  uint32_t width_px = 0;
  uint32_t height_px = 0;
  std::string solver;
  std::string where;                ///< "GPU" or "CPU"
  double relative_rms_error = 0;    ///< RMS error over RMS of the truth, both about their means
  double peak_to_valley_error = 0;  ///< relative
  Distribution time;                ///< of a solve whose gradients are in place, host clock
  double cpu_ms = 0;
  bool on_front = false;  ///< no other is both faster and better
};

/// Cost of a frame when some of its outputs are left out.
struct OutputFigure {
  std::string outputs;
  std::string reading;
  uint32_t width_px = 0;
  uint32_t height_px = 0;
  double touched_fraction = 0;  ///< of the frame's area
  Distribution time;            ///< of Pipeline::process
  double cpu_ms = 0;
  double cpu_ratio = 0;  ///< median over the rounds of CPU time over that of the full frame beside it
  double cpu_ratio_q25 = 0;
  double cpu_ratio_q75 = 0;
  uint64_t memory_bytes = 0;
};

/// Frames at the pace of a camera, the newest first: what was dropped, and how old the rest became.
struct PacedRun {
  uint32_t width_px = 0;
  uint32_t height_px = 0;
  double rate_Hz = 0;
  uint64_t frames = 0;
  uint64_t dropped_before_engine = 0;
  uint64_t dropped_before_display = 0;
  Distribution to_measured;  ///< from the frame's delivery to its Touch
  Distribution to_picture;   ///< from there to the picture drawn off-screen, of the frames that were drawn
};

/// A camera that sets the pace, with drawing.
struct LiveFigure : PacedRun {
  std::string reading;
};

/// A fast camera whose frames nobody draws or records: to_picture is empty.
struct RateFigure : PacedRun {
  std::string scene;
  double frames_per_s = 0;  ///< every frame measured as fast as it goes; 0: was not measured
};

/// A part of a thread's work on one frame.
struct ThreadPart {
  std::string thread;      ///< capture, engine, drawing, record
  std::string step;        ///< one of kPhotonSteps (photon.h)
  std::string part;        ///< name of its spans in a trace
  Distribution time;       ///< of single spans, without those within them
  double ms_per_turn = 0;  ///< mean over the frames that came to the thread
  double busy = 0;         ///< fraction of the run's time
};

/// A camera that sets the pace, with drawing and recording: what each thread does in a frame's time.
/// `frames_per_s` is without both.
struct PhotonFigure : RateFigure {
  double waits_ms = 0;  ///< mean age of a picture, less the work on it
  std::vector<ThreadPart> parts;
};

struct Skipped {
  std::string what;
  std::string why;
};

struct Profile {
  bool complete = false;  ///< false: Ctrl-C ended it, or nothing of it is there yet
  double budget_s = 0;
  double elapsed_s = 0;
  Machine machine;
  Ceiling ceiling;
  std::vector<SizeFigure> sizes;
  std::vector<Growth> growth;
  std::vector<SolverFigure> solvers;
  std::vector<OutputFigure> outputs;
  std::vector<LiveFigure> live;  ///< this and the next two are empty in files of before there were any
  std::vector<RateFigure> rates;
  std::vector<PhotonFigure> photon;
  std::vector<Skipped> skipped;
};

json::Value to_json(const Profile& profile);
/// The same as profile.json holds it.
std::string file_text(const Profile& profile);
/// Throws Error(Failure::Input) in one line that names the file and what is wrong with it: missing, not JSON,
/// another kind of file, another version, a number that is absent, not finite or negative.
Profile load_profile(const std::filesystem::path& file);
/// The same of a file's text; `file` stands for it in messages.
Profile parse_profile(const std::string& text, const std::filesystem::path& file);

/// "640 x 480".
std::string size_text(uint32_t width_px, uint32_t height_px);

}  // namespace palpate::perf

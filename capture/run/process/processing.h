// Processing of a recording from its first frame to its last: measurements, depth maps, pictures. No frame is
// dropped.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "capture/files/depth/depth_files.h"
#include "capture/files/frame_range.h"
#include "capture/files/measurements.h"
#include "capture/files/traction_files.h"
#include "capture/open_source.h"
#include "capture/run/largest.h"
#include "capture/run/process/comparison.h"
#include "capture/run/process/touch_table.h"
#include "capture/run/process/verify_recording.h"
#include "capture/run/run_settings.h"
#include "capture/run/run_watch.h"
#include "engine/base/facts.h"
#include "engine/measure/picture/pad_flaws.h"
#include "engine/palpation/press_monitor.h"
#include "engine/pipeline/surface_map.h"
#include "palpate/pipeline.h"

namespace palpate {
namespace gpu {
class Context;
}
struct FilesForOthers;

/// Inputs of the pictures of a recording; all must outlive them.
struct PictureSetting {
  const Sensor& sensor;
  const Frame& background;     ///< the untouched image
  std::filesystem::path film;  ///< file of the film, made with its first picture
  double film_rate_Hz = 30;
  bool separate = false;  ///< pictures of separate presses: nothing to draw over time
};

/// Draws the frames of a recording, in order.
class RecordingPictures {
 public:
  virtual ~RecordingPictures() = default;
  /// A frame that is measured but not drawn.
  virtual void follow(const Touch& touch) = 0;
  /// `png`: the picture's file, empty for none. Throws Error(Failure::Output), as finish().
  virtual void draw(const Frame& frame, const Touch& touch, const Result& result,
                    const std::filesystem::path& png, bool to_film) = 0;
  /// Ends the film.
  virtual void finish() = 0;
};

/// Settings that count: those of measuring, `rate_Hz` of inputs without one (0: their times stay unknown),
/// and `max_frames`. Pictures without a rate, where none is given, are presses of their own unless they are
/// `one_sequence`: what only a sequence shows (shift, shear, slip, the skin's motion) is then not measured.
/// Without a solver: SurfaceSolver::Best.
struct ProcessRequest : RunSettings {
  Outputs outputs = Output::Force | Output::Surface;
  /// Measures the frames of a session that were measured when it was recorded, with its outputs and its
  /// solver; compared with what was recorded.
  bool as_recorded = false;
  std::vector<DepthFormat> depth;        ///< one file a frame of each
  std::vector<DepthFormat> confidence;   ///< the same: PNG and NumPy only
  std::vector<TractionFormat> traction;  ///< the same, with Output::Traction
  bool pictures = false;                 ///< PNGs as the window would show the frames
  bool video = false;                    ///< the same as recording.mp4
  bool mcap = false;                     ///< recording.mcap and metadata.yaml, see capture/mcap
  bool cloud = false;                    ///< with points in it
  std::filesystem::path episode;         ///< file of HDF5, see capture/hdf5; also without a folder
  /// Of a finger: files of both for these two, which the caller closes; null: its own.
  FilesForOthers* both = nullptr;
  std::string side;     ///< "left" or "right" in them
  double offset_s = 0;  ///< to add to its times for theirs
  bool rows = true;     ///< measurements.csv, summary.csv, and contacts.csv with Output::Contacts
  Digits digits = Digits::Deserved;  ///< of the rows
  std::function<void(const std::string& json)>
      on_row;  ///< receives each frame as json_line writes it; may be null
  /// Receives each frame of the range while its maps can be read; may be null.
  std::function<void(const Pipeline&, const Result&, const Frame&)> on_result;
  std::string images;  ///< ".png" or ".tif": the frames themselves too; empty: not
  /// Frames that are counted and written; those before are measured only where shear, slip and shift need it.
  FrameRange range;
  uint64_t picture_every = 1;  ///< one picture and one video frame for that many frames
  std::vector<uint64_t>
      picture_frames;  ///< pictures of these frames only, ascending; empty: as picture_every says
  /// Callback that draws pictures and film, where these are requested.
  std::function<std::unique_ptr<RecordingPictures>(gpu::Context&, const PictureSetting&)> draw;
  /// Factory of the monitor of presses of a block of tissue, from the untouched image; may be null, and may
  /// return null.
  std::function<std::unique_ptr<PressMonitor>(const Frame& background)> watch;
  std::optional<double> log_offset_s;  ///< to add to the times of `logs`; none: found
};

/// Counts over the frames of a recording.
struct ProcessSummary {
  SurfaceSolver solver = SurfaceSolver::Best;  ///< that the frames were solved with
  SolveBy solved_by = SolveBy::Device;         ///< never Auto
  uint64_t frames = 0;
  std::string columns;   ///< names of those of measurements.csv, commas between
  uint64_t touches = 0;  ///< times that something touches: frames that touch after one that does not
  uint64_t contact_frames = 0;
  uint64_t most_contacts = 0;  ///< separate contacts in one frame (Output::Contacts)
  uint32_t contact_ids = 0;    ///< given out in the frames counted
  uint64_t overflow_frames =
      0;  ///< with more regions than there was room for: their contacts are not counted
  uint64_t saturated_frames = 0;  ///< with at least one saturated pixel
  uint64_t slip_frames = 0;
  std::map<std::string, uint64_t> force_states;  ///< frames in each state of the force
  bool separate = false;  ///< each frame was a press of its own: touches are pictures that are touched
  Largest force_N, depth_mm;
  uint64_t depth_clipped_px = 0;
  uint64_t clipped_frames = 0;        ///< whose depth is too small because slopes were clipped
  uint64_t extrapolated_frames = 0;   ///< whose depth calibration did not see enough for
  uint64_t weighted_frames = 0;       ///< whose surface was solved with unknown pixels left out
  uint64_t island_frames = 0;         ///< in which unknown pixels cut the touched surface into parts
  uint64_t light_changed_frames = 0;  ///< from which a change of light was taken out
  uint64_t light_unknown_frames = 0;
  double seconds = 0;                     ///< wall time from the first frame to the last result
  bool complete = false;                  ///< false: it was stopped, or a damaged recording ended it early
  std::string ended_by;                   ///< why, where not complete
  std::optional<Comparison> comparison;   ///< of inputs that know the truth
  std::optional<RecordedCheck> recorded;  ///< with as_recorded
  std::vector<PressAnswer> presses;       ///< of a block of tissue
  std::string warning;                    ///< of the source: a session that was cut short
  uint64_t damaged_frames = 0;            ///< left out by the source: they do not decode whole
  std::map<std::string, uint64_t> spoilt_pictures;  ///< of which nothing is measured, by what is wrong
  uint64_t repeated_frames = 0;                     ///< equal to the frame before in every pixel
  std::vector<TouchSpan> spans;                     ///< each time that something touches
  std::vector<std::string> sources;  ///< files of the frames, in the order in which they were measured
  BackgroundOrigin untouched = BackgroundOrigin::None;
  FlawSummary flaws;              ///< of the pad since its untouched image, filled from around
  std::vector<std::string> logs;  ///< a line of each log beside the frames, with how it was aligned
  std::string untouched_warning;  ///< that the untouched image shows a touch, see RestCheck
};

/// Processes `request.input` with `sensor` into folder `out`: measurements.csv and contacts.csv row by row,
/// depth/, pictures/, recording.mp4, recording.mcap, NAME_log.csv of the logs of a session and of those that
/// are given, images/ with the sensor.json and background.png that measure them again, and at the end
/// summary.json. Without a folder nothing is written: the request may not ask for files. A damaged recording
/// keeps the rows before the damage, writes a summary that says so, and throws.
ProcessSummary process_recording(gpu::Context& context, const Sensor& sensor, const ProcessRequest& request,
                                 const std::filesystem::path& out, const RunWatch& watch);

/// Summary of a recording and, for inputs with known truth, a table of errors: a line for each quantity with
/// frames, mean error, RMS error, largest error and full scale.
Facts facts_of(const ProcessSummary& summary, const ProcessRequest& request, const Sensor& sensor,
               const gpu::Context& context);

}  // namespace palpate

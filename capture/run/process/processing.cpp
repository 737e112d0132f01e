#include "capture/run/process/processing.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "capture/files/images/images.h"
#include "capture/files/output_file.h"
#include "capture/run/input.h"
#include "capture/run/process/files_for_others.h"
#include "capture/run/process/logs_beside.h"
#include "capture/run/rest_check.h"
#include "capture/run/run_recording.h"
#include "capture/series.h"
#include "capture/session/info.h"
#include "engine/base/clock.h"
#include "engine/gpu/context.h"
#include "engine/pipeline/pipeline_access.h"
#include "engine/pipeline/surface_map.h"
#include "engine/sensor/fit.h"
#include "palpate/error.h"

namespace palpate {
namespace {

/// Whether a format holds depths of a limited range only.
bool has_range(DepthFormat format) {
  return format == DepthFormat::Png16 || format == DepthFormat::Tiff;
}

/// Writes the files with which images of rectified frames can be measured again: the sensor without
/// rectification, and the untouched image.
void write_image_setting(Sensor sensor, const Frame& background, const std::filesystem::path& out) {
  sensor = for_rectified_frames(std::move(sensor));
  if (sensor.background.kind == BackgroundKind::Untouched) {
    write_whole(out / "background.png", encode_image(background, ".png"));
    sensor.background.image = "background.png";
  }
  if (std::isfinite(sensor.pitch_mm_per_px)) save_sensor(sensor, out / "sensor.json");
}

/// Turns results into files and counts, one frame after the other.
class Recorder {
 public:
  /// `session`: to compare with what it recorded, or null.
  Recorder(gpu::Context& context, const Sensor& sensor, const ProcessRequest& request, const Source& source,
           const Session* session, const Pipeline& pipeline, const std::filesystem::path& out,
           const Frame& background, bool separate, ProcessSummary& summary)
      : sensor_(sensor),
        request_(request),
        source_(source),
        session_(session),
        pipeline_(pipeline),
        out_(out),
        summary_(summary),
        has_truth_(source.truth(0).has_value()),
        has_names_(!source.frame_name(0).empty()),
        rate_Hz_(source.rate_Hz() > 0 ? source.rate_Hz() : request.rate_Hz),
        files_(request.both ? *request.both : own_files_),
        start_ns_(std::llround(1e9 * request.offset_s)),
        touches_(separate) {
    columns_ = MeasuredColumns::of(sensor, request.outputs, separate)
                   .with(MeasuredColumns::Time, rate_Hz_ > 0)
                   .with(MeasuredColumns::Source, has_names_)
                   .with(MeasuredColumns::Truth, has_truth_);
    summary.columns = Measurements::header(columns_);
    if (request.rows) measurements_.emplace(out / "measurements.csv", columns_, request.digits);
    if (request.rows && wants(request.outputs, Output::Contacts))
      contacts_.emplace(out / "contacts.csv", columns_, request.digits);
    if ((request.rows || request.mcap || !request.episode.empty()) && rate_Hz_ > 0)
      logs_.emplace(request.input, request.logs, request.log_offset_s);
    if (request.mcap || !request.episode.empty()) begin_files_for_others(context, source);
    if (has_truth_) summary.comparison.emplace();
    if (session_) summary.recorded.emplace();
    const auto empty_folder = [&](const char* name) {
      make_output_folder(out / name);
      clear_numbered_files(out / name);
    };
    if (!request.depth.empty()) empty_folder("depth");
    if (!request.confidence.empty()) empty_folder("confidence");
    if (!request.traction.empty()) empty_folder("traction");
    if (request.pictures) empty_folder("pictures");
    if (!request.images.empty()) empty_folder("images");
    if (request.pictures || request.video) {
      // Pictures without times are looked at one by one.
      constexpr double kStillsRate_Hz = 2;
      const double rate_Hz = rate_Hz_ > 0
                                 ? rate_Hz_ / static_cast<double>(request.picture_every * request.range.step)
                                 : kStillsRate_Hz;
      pictures_ = request.draw(context, {sensor, background, out / "recording.mp4", rate_Hz, separate});
    }
  }

  void add(const Result& result, const Frame& frame) {
    Touch touch = result.touch;
    if (!request_.range.contains(touch.sequence)) return;
    if (source_.rate_Hz() <= 0 && rate_Hz_ > 0) {
      touch.time_ns = std::llround(static_cast<double>(touch.sequence) / rate_Hz_ * 1e9);
    }
    std::optional<Truth> truth = has_truth_ ? source_.truth(touch.sequence) : std::nullopt;
    std::optional<double> depth_rms_error_mm;
    const bool compare_depth =
        truth && touch.surface && truth->depth_mm.size() == size_t{map_width()} * map_height();
    const bool seen = touch.picture == PictureFault::None;
    const bool mesh_of_traction =
        std::ranges::find(request_.traction, TractionFormat::Ply) != request_.traction.end();
    if (seen && touch.surface && (!request_.depth.empty() || compare_depth || mesh_of_traction)) {
      depth_mm_ = result.depth_mm();
      if (compare_depth) depth_rms_error_mm = rms_difference(depth_mm_, truth->depth_mm);
      write_depths(touch.sequence);
    }
    if (!request_.confidence.empty()) {
      const std::span<const uint16_t> pixels = result.confidence();
      for (const DepthFormat format : request_.confidence)
        write_confidence(out_ / "confidence" / numbered_name(touch.sequence, extension(format)), pixels,
                         map_width(), map_height(), format);
    }
    for (const TractionFormat format : request_.traction) {
      if (!seen) break;
      write_traction(out_ / "traction" / numbered_name(touch.sequence, extension(format)), result.traction,
                     view(), format);
    }
    if (!request_.images.empty())
      write_whole(out_ / "images" / (numbered_name(touch.sequence, request_.images.substr(1))),
                  encode_image(frame, request_.images));
    const std::string name = source_.frame_name(result.touch.sequence);
    if (has_names_) summary_.sources.push_back(name);
    const Truth* known = truth ? &*truth : nullptr;
    if (measurements_) measurements_->add(touch, known, depth_rms_error_mm, name);
    if (request_.on_row)
      request_.on_row(json_line(touch, columns_, request_.digits, known, depth_rms_error_mm, name));
    if (request_.on_result) request_.on_result(pipeline_, result, frame);
    if (contacts_) contacts_->add(touch, name);
    if (mcap_ || episode_) add_for_others(result, frame, touch, name);
    if (session_) summary_.recorded->add(*session_, touch);
    if (truth && seen) summary_.comparison->add(touch, *truth, depth_rms_error_mm);
    if (pictures_) draw(result, frame, touch);
    if (logs_) logs_->add(touch);
    touches_.add(touch, name);
    count(touch);
  }

  void close() {
    summary_.spans = touches_.spans();
    if (request_.rows && wants(request_.outputs, Output::Force))
      write_whole(out_ / "summary.csv", std::string_view(touches_.csv(columns_)));
    if (measurements_) measurements_->close();
    if (contacts_) contacts_->close();
    if (logs_) write_logs();
    if (pictures_) pictures_->finish();
    if (mcap_) add_events();
    if (date_ahead_ns_) files_.zero_ns = start_ns_ - std::llround(1e9 * request_.offset_s);
    if (!request_.both && summary_.complete) files_.close();
    if (!request_.both && !summary_.complete && files_.mcap) files_.mcap->close();
    if (!request_.confidence.empty())
      write_whole(
          out_ / "confidence" / "confidence.json",
          std::string_view(describe_confidence_folder(map_width(), map_height(), request_.confidence)));
    if (!request_.depth.empty()) {
      write_whole(out_ / "depth" / "depth.json",
                  std::string_view(describe_depth_folder(view(), request_.depth, clipped_px_)));
    }
  }

 private:
  uint32_t map_width() const { return pipeline_.format().width; }
  uint32_t map_height() const { return pipeline_.format().height; }
  DepthView view() const { return {depth_mm_, map_width(), map_height(), sensor_.pitch_mm_per_px}; }

  /// MCAP and HDF5.
  void begin_files_for_others(const gpu::Context& context, const Source& source) {
    const std::string session = session_folder() ? session_json(*session_folder()) : "";
    const std::optional<WallClock> clock = session_clock_of(session);
    if (clock) date_ahead_ns_ = clock->ahead_ns;
    std::map<std::string, std::string> facts = {{"input", request_.input}, {"device", context.report().name}};
    facts["stamps"] = clock ? "time of exposure since 1970, by the offset of the date that the session kept"
                      : rate_Hz_ > 0 || source.live() ? "since the recording began, its date is not known"
                                                      : "pictures without times, 0.1 s apart";
    if (request_.mcap) {
      McapOptions options{sensor_, request_.outputs, columns_, request_.cloud, facts, session, request_.side};
      if (!files_.mcap) files_.mcap.emplace(out_);
      mcap_.emplace(*files_.mcap, options);
    }
    if (request_.episode.empty()) return;
    facts["stamps"] = rate_Hz_ > 0 ? "time_s since the recording began" : facts["stamps"];
    if (!session.empty()) facts["session"] = session;
    const EpisodeOptions options{sensor_, pipeline_.format(), request_.outputs, columns_,
                                 facts,   request_.side};
    if (!files_.episode) files_.episode.emplace(request_.episode);
    episode_.emplace(*files_.episode, options);
  }

  void add_for_others(const Result& result, const Frame& frame, const Touch& touch, const std::string& name) {
    const std::optional<DepthMap> depth =
        depth_map_of(result, touch, pipeline_.format(), sensor_.pitch_mm_per_px);
    // Frames that know when they were exposed say when the recording began.
    if (frame.exposed_ns > 0 && date_ahead_ns_)
      start_ns_ = frame.exposed_ns + *date_ahead_ns_ - time_ns(touch);
    if (mcap_) mcap_->add(frame, touch, depth, start_ns_ + time_ns(touch), name);
    if (episode_)
      episode_->add(frame, touch, depth, static_cast<double>(time_ns(touch)) / 1e9 + request_.offset_s);
  }
  int64_t time_ns(const Touch& touch) const {
    return rate_Hz_ > 0 ? touch.time_ns
                        : std::llround(static_cast<double>(touch.sequence) / kFolderRate_Hz * 1e9);
  }

  void add_events() {
    if (session_folder())
      for (const viz::Event& event : viz::read_events(*session_folder()))
        if (request_.range.contains(event.frame))
          mcap_->add(event, start_ns_ + std::llround(event.time_s * 1e9));
  }
  /// That is read.
  std::optional<std::filesystem::path> session_folder() const {
    return is_session(request_.input) ? std::optional(palpate::session_folder(request_.input)) : std::nullopt;
  }
  static std::optional<WallClock> session_clock_of(const std::string& session) {
    return session.empty() ? std::nullopt : session_from_text(session, kSessionJson).clock;
  }

  /// Logs of other instruments, at the frames and in the files for others.
  void write_logs() {
    std::vector<AlignedLog> logs = logs_->take(summary_.logs);
    if (request_.rows && !out_.empty()) logs_->write(logs, out_);
    for (const AlignedLog& log : logs) {
      summary_.logs.push_back(describe(log));
      add_log(log, files_, start_ns_, request_.side.empty() ? "" : "/" + request_.side);
    }
  }

  void write_depths(uint64_t sequence) {
    for (const DepthFormat format : request_.depth) {
      const uint64_t clipped =
          write_depth(out_ / "depth" / numbered_name(sequence, extension(format)), view(), format);
      if (has_range(format)) clipped_px_[format] += clipped;
      summary_.depth_clipped_px += clipped;
    }
  }

  void draw(const Result& result, const Frame& frame, const Touch& touch) {
    const uint64_t sequence = result.touch.sequence;
    const bool in_step = sequence % request_.picture_every == 0;
    const std::vector<uint64_t>& chosen = request_.picture_frames;
    const bool to_file =
        request_.pictures &&
        (chosen.empty() ? in_step : std::binary_search(chosen.begin(), chosen.end(), sequence));
    const bool to_film = request_.video && in_step;
    if (!to_file && !to_film) {
      pictures_->follow(touch);
      return;
    }
    pictures_->draw(frame, touch, result,
                    to_file ? out_ / "pictures" / numbered_name(sequence, "png") : std::filesystem::path(),
                    to_film);
  }

  void count(const Touch& touch) {
    ++summary_.frames;
    summary_.repeated_frames += touch.repeated;
    if (touch.picture != PictureFault::None) {
      ++summary_.spoilt_pictures[to_string(touch.picture)];
      if (wants(request_.outputs, Output::Force)) ++summary_.force_states[to_string(touch.force_N.validity)];
      return;
    }
    if (touch.light) {
      summary_.light_changed_frames += touch.light->state == LightState::Changed;
      summary_.light_unknown_frames += touch.light->state == LightState::Unknown;
    }
    if (wants(request_.outputs, Output::Force)) {
      summary_.touches = touches_.spans().size();
      summary_.contact_frames += touch.contact;
      summary_.saturated_frames += touch.saturated_px > 0;
      summary_.most_contacts = std::max<uint64_t>(summary_.most_contacts, touch.contacts.size());
      summary_.overflow_frames += touch.regions && touch.regions->overflow;
      for (const ContactTouch& contact : touch.contacts) ids_.insert(contact.id);
      summary_.contact_ids = static_cast<uint32_t>(ids_.size());
      summary_.slip_frames += touch.slip == Slip::Slip;
      ++summary_.force_states[to_string(touch.force_N.validity)];
      if (has_value(touch.force_N)) summary_.force_N.add(touch.force_N);
    }
    if (touch.surface) {
      summary_.clipped_frames += touch.surface->validity == Validity::Clipped;
      summary_.extrapolated_frames += touch.surface->validity == Validity::Extrapolated;
      summary_.weighted_frames += touch.surface->weighted.has_value();
      summary_.island_frames += touch.surface->validity == Validity::Apart;
      summary_.depth_mm.add(
          {touch.surface->depth_max_mm, touch.surface->depth_sd_mm, touch.surface->validity});
    }
  }

  const Sensor& sensor_;
  const ProcessRequest& request_;
  const Source& source_;
  const Session* session_;
  const Pipeline& pipeline_;
  std::filesystem::path out_;
  ProcessSummary& summary_;
  bool has_truth_, has_names_;
  double rate_Hz_;
  MeasuredColumns columns_;
  std::optional<Measurements> measurements_;
  std::optional<ContactRows> contacts_;
  std::optional<LogsBeside> logs_;
  FilesForOthers own_files_;
  FilesForOthers& files_;
  std::optional<McapRecording> mcap_;
  std::optional<Episode> episode_;
  std::optional<int64_t> date_ahead_ns_;  ///< of the clock that stamps frames
  int64_t start_ns_;                      ///< of the recording, since 1970, or among those of both
  std::set<uint32_t> ids_;
  std::unique_ptr<RecordingPictures> pictures_;
  std::span<const float> depth_mm_;  ///< of the result that is added
  std::map<DepthFormat, uint64_t> clipped_px_;
  TouchTable touches_;
};

}  // namespace

ProcessSummary process_recording(gpu::Context& context, const Sensor& sensor, const ProcessRequest& request,
                                 const std::filesystem::path& out, const RunWatch& watch) {
  for (const char* folder : {"depth", "confidence", "traction", "pictures", "images"}) {
    std::error_code code;
    if (!out.empty() && std::filesystem::equivalent(request.input, out / folder, code)) {
      throw Error(Failure::Usage, "an --out folder that is not the input's", "'" + out.string() + "'",
                  "another --out folder");
    }
  }
  std::unique_ptr<Session> session;
  std::unique_ptr<Source> source;
  if (request.as_recorded) {
    session = std::make_unique<Session>(request.input, sensor);
    source = std::make_unique<MeasuredFrames>(*session);
  } else {
    source = open_source(request.input, sensor);
  }
  source->watch([&watch] { return watch.stopped(); });
  const Frame background = load_background(request.input, sensor, *source);
  const PipelineOptions measured = pipeline_options(request, request.outputs, *source, SurfaceSolver::Best);
  const bool separate = measured.separate;
  Pipeline pipeline(context, for_rectified_frames(sensor), source->format(), measured);
  pipeline.set_background(background);
  const std::unique_ptr<PressMonitor> presses = request.watch ? request.watch(background) : nullptr;

  if (!out.empty()) {
    make_output_folder(out);
    for (const char* stale :
         {"summary.json", "summary.csv", "recording.mp4", "contacts.csv", kMcapFile, kMcapYaml})
      std::filesystem::remove(out / stale);
  }
  ProcessSummary summary;
  summary.solver = measured.solver;
  summary.solved_by = pipeline.solved_by();
  summary.separate = separate;
  summary.untouched = background_origin(sensor, *source);
  if (separate) look_ahead(request.input, sensor, pipeline, watch.stop);
  std::optional<RestCheck> rest_check;
  if (summary.untouched == BackgroundOrigin::File || summary.untouched == BackgroundOrigin::FirstFrames)
    rest_check.emplace(background, sensor);
  Recorder recorder(context, sensor, request, *source, session.get(), pipeline, out, background, separate,
                    summary);
  uint64_t total = source->frame_count().value_or(0);
  if (request.max_frames != 0) total = total == 0 ? request.max_frames : std::min(total, request.max_frames);
  if (!request.images.empty()) write_image_setting(sensor, background, out);
  // Depth is each frame's own, except with contacts of a gel; what is followed from frame to frame is so from
  // the first one on.
  const bool followed = !separate && (request.rows || request.mcap || !request.episode.empty() ||
                                      request.on_row || request.pictures || request.video ||
                                      (wants(request.outputs, Output::Contacts) && has_gel_contacts(sensor)));
  if (!followed && request.range.first > 0) {
    Frame first;  // shows flaws that a later one may hide
    if (!separate && source->next(first)) PipelineAccess::look_ahead(pipeline, first);
    seek_frame(*source, request.range.first);
  }

  const int64_t start_ns = monotonic_ns();
  const auto finish = [&] {
    summary.seconds = 1e-9 * static_cast<double>(monotonic_ns() - start_ns);
    summary.warning = source->warning();
    if (const std::string unused = unused_rate(*source, request.rate_Hz); !unused.empty())
      summary.warning += (summary.warning.empty() ? "" : "; ") + unused;
    summary.damaged_frames = source->counts().damaged;
    if (presses) summary.presses = presses->finish();
    summary.flaws = PipelineAccess::flaws(pipeline);
    if (rest_check) summary.untouched_warning = rest_check->warning();
    recorder.close();
    if (!out.empty())
      write_whole(out / "summary.json",
                  std::string_view(
                      facts_of(summary, request, sensor, context).json.dump(2, json::Utf8::Replace) + "\n"));
  };
  try {
    const RunWatch::Progress progress = watch.begin("processing", total);
    uint64_t done = 0;
    run_recording(
        *source, pipeline, request.max_frames, watch.stop,
        [&](const Result& result, const Frame& frame) {
          recorder.add(result, frame);
          const bool seen = result.touch.picture == PictureFault::None;
          if (rest_check && seen) rest_check->add(frame);
          if (presses && seen) presses->add(frame, result.touch);
          progress(++done);
        },
        request.range.end);
    if (!watch.stopped() && source->cut_short())
      throw Error(Failure::Input,
                  std::to_string(source->frame_count().value_or(0)) + " frames in '" + request.input + "'",
                  std::to_string(summary.frames) + ", which are measured: the file is damaged or cut short",
                  "copying it again");
  } catch (const Error& error) {
    // A damaged recording or a lost device ends the run; the frames before it are whole.
    const bool kept = error.failure() == Failure::Input || error.failure() == Failure::Device;
    if (!kept || summary.frames == 0) throw;
    summary.ended_by = error.what();
    finish();
    throw;
  }
  summary.complete = !watch.stopped();
  if (!summary.complete) summary.ended_by = "interrupted";
  if (summary.complete && summary.frames == 0) {
    const std::string range = to_string(request.range);
    throw Error(Failure::Input, "frames" + (range.empty() ? "" : " " + range) + " in '" + request.input + "'",
                "none", range.empty() ? "another recording" : "a range within the recording");
  }
  finish();
  return summary;
}

}  // namespace palpate

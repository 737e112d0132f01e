// What the live window does beyond the view when a person asks for it: recording, snapshots, zeros, events,
// places of a replay.
#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "capture/files/event_log.h"
#include "capture/files/output_file.h"
#include "capture/live/recorder.h"
#include "engine/measure/force.h"
#include "palpate/error.h"
#include "viz/display/display.h"
#include "viz/display/picture.h"
#include "viz/display/snapshot.h"
#include "viz/render/format.h"
#include "viz/report/scan_report.h"

namespace palpate::viz {

void Display::save_snapshot() {
  auto image = window_.captured();
  if (!image) {
    stats_.note = "snapshots are not possible on this display";
    return;
  }
  if (notes_folder().empty()) {
    stats_.note = kNoFolder;
    return;
  }
  Snapshot snapshot = snapshot_of(current_->captured->frame, current_->result, columns_, pitch_mm_per_px_);
  snapshot.picture = std::move(*image);
  const GrowingMap* const map = scene_.layout().has_map && scene_.map().map ? map_ : nullptr;
  const std::shared_ptr<const SeenScan> scan = scan_ ? scan_->status().seen : nullptr;
  background_.add([snapshot = std::make_shared<Snapshot>(std::move(snapshot)), map, scan,
                   input = options_.input, stem = next_file(notes_folder(), "palpate", snapshots_)] {
    std::string names = write_snapshot(*snapshot, stem);
    if (map && !map->write(stem.string() + "-map").empty()) names += ", -map";
    if (scan && scan->answer) {
      write_scan(report_of(*scan, input), stem.string() + "-scan");
      names += ", -scan";
    }
    return "wrote " + names;
  });
}

void Display::save_charts(bool table, bool picture) {
  if (notes_folder().empty()) {
    stats_.note = kNoFolder;
    return;
  }
  const std::filesystem::path stem = next_file(notes_folder(), "charts", charts_);
  if (picture && scene_.layout().has_charts) chart_picture_ = stem.string() + ".png";
  if (!table) {
    if (!scene_.layout().has_charts) stats_.note = "no charts are shown (P)";
    return;
  }
  background_.add([table = scene_.chart_table(), file = stem.string() + ".csv"] {
    make_output_folder(std::filesystem::path(file).parent_path());
    write_whole(file, table);
    return "wrote " + file;
  });
}

void Display::save_chart_picture() {
  auto image = window_.captured();
  const std::filesystem::path file = std::exchange(chart_picture_, {});
  if (!image) {
    stats_.note = "pictures of the charts are not possible on this display";
    return;
  }
  background_.add([part = part_of(*image, scene_.layout().charts), file] {
    make_output_folder(file.parent_path());
    write_png(part, file);
    return "wrote " + file.string();
  });
}

void Display::switch_recording() {
  if (!options_.recording) {
    stats_.note = options_.replay ? "a replay cannot be recorded" : kNoFolder;
    return;
  }
  try {
    if (options_.recording->on()) {
      options_.recording->stop();
      stats_.note = "wrote " + options_.recording->latest().folder.string();
    } else {
      options_.recording->start();
      stats_.note.clear();
    }
  } catch (const Error& e) {
    stats_.note = e.what();  // a full disk must not end a measurement
  }
}

/// Snapshots and events have one place.
std::filesystem::path Display::notes_folder() const {
  const bool recording = options_.recording && options_.recording->on();
  return recording ? options_.recording->latest().folder : shown_.notes;
}

/// False where there is no place.
bool Display::write_event(const Event& event) {
  scene_.mark(event);
  const std::filesystem::path folder = notes_folder();
  if (folder.empty()) return false;
  background_.add([folder, event] {
    append_event(folder, event);
    return std::string();
  });
  return true;
}

void Display::log_event(const char* kind, const std::string& words) {
  const Touch& touch = current_->result.touch;
  const Event event{touch.sequence, 1e-9 * static_cast<double>(touch.time_ns), kind, words};
  stats_.note =
      write_event(event)
          ? text("'%s' at frame %llu, in %s", label_of(event).c_str(),
                 static_cast<unsigned long long>(event.frame), (notes_folder() / "events.csv").c_str())
          : text("'%s' is in this window only: %s", label_of(event).c_str(), kNoFolder);
}

/// Results of presses since the last call.
void Display::update_presses() {
  stats_.press = options_.presses->status();
  const std::optional<PressAnswer>& last = stats_.press->last;
  if (!last || last->press == presses_) return;
  presses_ = last->press;
  restless_ = 3;
  const Event event{last->last_frame, last->time_s, "lump", describe(*last)};
  // A recording gives the same results each time it is played, so its list of events does not grow.
  if (options_.replay)
    scene_.mark(event);
  else
    write_event(event);
}

void Display::finish_presses() {
  update_presses();
  background_.finish();
}

void Display::mark_event() {
  ViewState& state = scene_.state();
  ++marks_;
  const std::string typed = state.label.text.data();
  state.label.text = {};
  log_event("mark", typed.empty() ? std::to_string(marks_) : typed);
}

void Display::switch_zero(bool on) {
  ViewState& state = scene_.state();
  if (!on) {
    if (!state.tare.on) return;
    state.tare = {};
    log_event("zero ended", "as measured");
    return;
  }
  if (!state.tare.set(current_->result.touch)) {
    const bool touches = current_->result.touch.contact;
    stats_.note = touches ? "nothing to zero: this sensor has no force calibration"
                          : "nothing to zero: nothing touches the pad";
    return;
  }
  log_event("zero", state.tare.words());
}

/// In a replay: to `seconds` before or after the present frame.
void Display::jump(double seconds) {
  const std::shared_ptr<Source> source = session_.source();
  const double rate_Hz = source->rate_Hz() > 0 ? source->rate_Hz() : 10;
  Transport& transport = session_.transport;
  const auto position = static_cast<int64_t>(transport.position);
  int64_t to = position + std::llround(seconds * rate_Hz);
  const std::vector<double> times_s = source->uneven_times_s();
  if (position < static_cast<int64_t>(times_s.size()))
    to =
        std::ranges::lower_bound(times_s, times_s[static_cast<size_t>(position)] + seconds) - times_s.begin();
  transport.steps = 0;  // those asked for before it are not taken from there
  transport.seek_to = std::max<int64_t>(0, to);
}

/// In a replay: to a mark or to the largest force, and the part that is played again and again.
void Display::go_to(const PlayRequest& play) {
  ViewState& state = scene_.state();
  const History& history = scene_.history();
  const Timeline& timeline = history.timeline();
  if (play.marks != 0) {
    const auto time = history.next_event(history.now(), play.marks > 0);
    if (time)
      state.seek_to = timeline.frame_at(*time);
    else
      stats_.note = play.marks > 0 ? "no mark after this frame" : "no mark before this frame";
  }
  if (play.largest) {
    const TimeSpan all{timeline.start() + timeline.length(), timeline.length()};
    const Sample* largest = largest_of(history.samples(), all, [](const Sample& s) {
      return has_value(s.force_N) ? s.force_N : s.layer_N.value_or(Estimate{});
    });
    if (!largest)
      largest = largest_of(history.samples(), all, [](const Sample& s) {
        return Estimate{s.depth_mm, 0, s.has_depth ? Validity::Valid : Validity::NotCalibrated};
      });
    if (largest)
      state.seek_to = largest->position;
    else
      stats_.note = "no force and no depth was measured yet";
    if (largest) state.paused = true;
  }
  if (play.part == PartEnd::Keep) return;
  Transport& transport = session_.transport;
  const uint64_t at = current_->captured->position;
  state.part = with_end(state.part, play.part, at, session_.source()->frame_count().value_or(0));
  transport.part_first = state.part ? static_cast<int64_t>(state.part->first) : Transport::kNowhere;
  transport.part_last = state.part ? static_cast<int64_t>(state.part->last) : Transport::kNowhere;
  // A player that waits at the end goes on with the part.
  if (state.part && transport.at_end) state.seek_to = state.part->first;
  stats_.note = state.part ? text("loops from frame %llu to %llu",
                                  static_cast<unsigned long long>(state.part->first) + 1,
                                  static_cast<unsigned long long>(state.part->last) + 1)
                           : "plays all of it";
}

/// In a replay: to where the person wants it.
void Display::go_on_playing() {
  ViewState& state = scene_.state();
  Transport& transport = session_.transport;
  const PlayRequest play = std::exchange(state.play, {});
  go_to(play);
  if (const auto frame = std::exchange(state.seek_to, {})) {
    const uint64_t frames = session_.source()->frame_count().value_or(0);
    transport.steps = 0;
    transport.seek_to = static_cast<int64_t>(frames > 0 ? std::min(*frame, frames - 1) : *frame);
  }
  if (play.seconds != 0) jump(play.seconds);
  if (play.frames != 0) transport.steps += play.frames;
  if (play.speed != 1)
    transport.speed = std::clamp(transport.speed * play.speed, LiveOptions::kSlowest, LiveOptions::kFastest);
}

/// Between two pictures.
void Display::carry_out_requests() {
  ViewState& state = scene_.state();
  if (std::exchange(state.next_vsync_requested, false)) {
    do {
      state.vsync = static_cast<Vsync>((static_cast<int>(state.vsync) + 1) % 3);
    } while (!window_.offers(state.vsync));  // On is always offered
  }
  window_.set_vsync(state.vsync);
  state.vsync = window_.vsync();
  const auto requested = [this](bool& request) {
    if (!std::exchange(request, false)) return false;
    restless_ = 3;
    return true;
  };
  if (requested(state.recording_switched_requested)) {
    switch_recording();
    stats_due_ = {};
  }
  if (requested(state.zero_requested)) switch_zero(true);
  if (requested(state.track_requested)) {
    session_.track_anew = true;
    state.map_eye = {};
    if (map_) map_->restart();
    if (scan_) scan_->restart();
  }
  if (requested(state.zero_cleared_requested)) switch_zero(false);
  if (requested(state.mark_requested)) mark_event();
  const bool table = requested(state.chart_table_requested),
             picture = requested(state.chart_picture_requested);
  if (table || picture) save_charts(table, picture);
  if (requested(state.full_screen_requested)) window_.switch_full_screen();
  if (const auto block = std::exchange(state.block_requested, {}); block && options_.presses) {
    try {
      options_.presses->set_block(*block);
      stats_.note = "the block's new values hold from the next press on";
    } catch (const Error& error) {
      stats_.note = error.what();
    }
    restless_ = 3;
  }
  if (requested(state.sources_requested)) {
    sources_requested_ = shown_.from_list;
    if (!shown_.from_list) stats_.note = "the list of sources is that of palpate without a command";
  }
  if (state.paused != session_.paused) {
    session_.paused = state.paused;
    stats_.note = state.paused ? "paused" : "";
    restless_ = 3;
  }
  if (options_.replay) go_on_playing();
  if (state.close_requested) glfwSetWindowShouldClose(window_.handle(), GLFW_TRUE);
}

}  // namespace palpate::viz

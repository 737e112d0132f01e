// View state: the user's choices in the window, and the scales that adapt to the touch automatically.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "engine/palpation/press_observation.h"
#include "palpate/sensor.h"
#include "palpate/touch.h"
#include "viz/live/history.h"
#include "viz/live/tare.h"
#include "viz/live/vsync.h"
#include "viz/render/map_eye.h"
#include "viz/render/orbit.h"
#include "viz/render/surface_view.h"
#include "viz/render/view_settings.h"

namespace palpate::viz {

/// 1, 2 or 5 times a power of ten, at least `value`: distances of ticks.
double nice_ceiling(double value);
/// A round number of a finer series (1, 1.5, 2, 2.5, 3, 4, 5, 6, 8), at least `value`: ends of scales.
double scale_ceiling(double value);

/// Seconds of the strip charts' time axis that the user can choose.
inline constexpr std::array<double, 4> kChartSpans_s{5, 10, 30, 60};

/// Words that a person types in a field of the window.
struct TypedText {
  std::array<char, 64> text{};
  bool takes_letters = false;   ///< the field has the keyboard
  std::vector<uint16_t> early;  ///< letters typed before that
};

/// A part of a recording that is played again and again: frames from 0, both ends in it.
struct PlayedPart {
  uint64_t first = 0, last = 0;
  bool operator==(const PlayedPart&) const = default;
};
/// That of the shown frame `at`: the end of a part that is put there, of a recording of `frames`.
enum class PartEnd { Keep, First, Last, None };
std::optional<PlayedPart> with_end(std::optional<PlayedPart> part, PartEnd end, uint64_t at, uint64_t frames);

/// Where a person wants a replay to go, from where it is.
struct PlayRequest {
  double seconds = 0;
  int frames = 0;
  double speed = 1;      ///< times the present one
  int marks = 0;         ///< 1: to the mark after it, -1: to the one before it
  bool largest = false;  ///< to the largest force that was measured, without one the largest depth
  PartEnd part = PartEnd::Keep;
};

/// Where keys want the charts' cursor and the part of time that they show, in shares of that part.
struct ChartMoves {
  double cursor = 0, pan = 0;  ///< to later times
  double zoom = 1;             ///< times its length
};

struct ViewState : ViewSettings {
  static constexpr double kLeastRange_mm = 0.02, kMostRange_mm = 10;
  static constexpr double kLeastRange_MPa = 1e-4, kMostRange_MPa = 10;
  static constexpr double kLeastStrain = 0.001, kMostStrain = 10;
  static constexpr double kLeastFriction = 0.01, kMostFriction = 10;

  Camera camera;
  bool automatic_range = true;     ///< of depth
  bool automatic_pressure = true;  ///< range of pressure
  double range_mm = 0.1;           ///< depth with the last colour, and at the foot of the drawn box
  double range_MPa = 0.01;         ///< pressure with the last colour
  double strain_range = 0.05;      ///< strain with the last colour; set by hand
  double friction_range = 1;       ///< shear over pressure with the last colour: the sensor's coefficient
  bool automatic_exaggeration = true;
  double exaggeration = 10;
  bool can_show_pressure = false;  ///< the sensor reads it
  bool can_show_friction = false;  ///< its layer and its skin give both
  bool can_show_traction = false;  ///< its layer gives pressure, with a skin shear as well
  bool can_show_strain = true;     ///< of the surface's area: its slopes are seen, not computed from pressure
  bool can_show_skin = true;       ///< it follows its skin
  bool has_object_map = false;     ///< a map is made of what touches the pad, or is pressed by hand
  bool whole_recording = true;     ///< charts of a replay from end to end, else chart_span_s
  std::optional<TimeSpan>
      chart_view;  ///< part of the charts' time that was zoomed or panned to; none: as above
  std::optional<std::array<float, 2>> chart_menu;  ///< place of the charts' open menu, px
  std::optional<double> chart_cursor;              ///< time that keys chose to read them at
  double skin_strain_range = 0.005;                ///< with the last colour; follows the touch
  MapEye map_eye;                                  ///< of the map beside the pictures
  bool sensor_panel = false;
  bool help = false;
  bool paused = false;
  Vsync vsync = Vsync::On;
  Tare tare;
  bool replay = false;       ///< a recording is played
  double frame_aspect = 1;   ///< width over height
  double pad_mm = 1;         ///< its longest side
  bool labelling = false;    ///< a text for an event is being typed
  TypedText label;           ///< that text
  bool palette = false;      ///< an action is searched by name
  TypedText searched;        ///< that name
  int found = 0;             ///< the one of those found that Enter takes
  bool mouse_taken = false;  ///< by something that is dragged: the camera stays

  // Requests of the person, each cleared by the code that carries it out.
  bool snapshot_requested = false;
  bool recording_switched_requested = false;
  bool zero_requested = false;
  bool zero_cleared_requested = false;
  bool track_requested = false;    ///< the object's motion counts anew
  bool mark_requested = false;     ///< with the text in `label`, which may be empty
  bool sources_requested = false;  ///< back to the list
  bool full_screen_requested = false;
  bool next_vsync_requested = false;
  bool close_requested = false;
  PlayRequest play;
  std::optional<PlayedPart> part;      ///< none: all is played once
  bool chart_table_requested = false;  ///< a file of what the charts show
  ChartMoves chart_moves;
  bool chart_copy_requested = false;        ///< what they show, to the clipboard
  bool chart_picture_requested = false;     ///< a picture of them
  std::optional<BlockSetting> block_draft;  ///< as typed, while it is
  std::optional<BlockSetting> block_requested;
  std::optional<uint64_t> seek_to;   ///< frame of a replay; beyond its end: the last
  std::optional<uint64_t> bar_held;  ///< frame at which its bar is held

  /// Those of an earlier run; views that this sensor cannot show are replaced.
  void choose(const ViewSettings& settings);
  /// What stands now; views that this sensor cannot show stay as they were chosen with one that can.
  ViewSettings chosen(const ViewSettings& before) const;
  bool can_show(Quantity shown) const;
  /// To the next quantity that this sensor has.
  void next_quantity();
  /// Range of the colours of the quantity that is shown, times `factor`, within its limits; no longer
  /// automatic.
  void widen_range(double factor);
  /// Longer or shorter strip charts; of a replay the longest is the whole recording.
  void change_chart_span(int steps);
  /// Whether the colours' range follows the touch; null for what is set by hand.
  bool* automatic();
  /// Views that this sensor cannot show are replaced.
  void fit_to(const Sensor& sensor);

  /// Follows the touch where automatic: the range grows at once and shrinks only after seconds of lighter
  /// contact, so that colours keep their meaning from frame to frame.
  void follow(const Touch& touch, double longest_side_mm);
  void follow_pressure(double largest_MPa);
  void follow_skin_strain(double largest);
  SurfaceStyle style(double longest_side_mm) const;

 private:
  void replace_hidden();

  int64_t smaller_since_ns_ = 0;
  bool smaller_ = false;
  double smaller_peak_mm_ = 0;
};

}  // namespace palpate::viz

#include "capture/calibrate/photometric/presses.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <map>
#include <memory>
#include <tuple>

#include "capture/calibrate/frame/markers.h"
#include "capture/calibrate/photometric/pad_match.h"
#include "capture/files/csv_table.h"
#include "capture/files/image_sequence.h"
#include "capture/files/images/images.h"
#include "capture/open_source.h"
#include "capture/run/rest_check.h"
#include "engine/base/text.h"
#include "engine/calibrate/ball/ramp.h"
#include "palpate/error.h"

namespace palpate {
namespace {

namespace fs = std::filesystem;

constexpr uint64_t kMostLooked = 400;
constexpr size_t kMostPresses = 200;
constexpr double kMoved = 0.5;         // of the contact's radius: another press
constexpr double kDeeper = 1.0 / 6;    // change of the radius: another press
constexpr double kUnlikeOthers = 1.8;  // a press's ramp over the median of all
constexpr size_t kEnoughToCompare = 4;
constexpr double kLeastInFrame = 0.7;  // of a contact on a colour gel, whose circle shows from a part

std::string count_text(size_t count, const char* what) {
  return std::to_string(count) + " " + what + (count == 1 ? "" : "s");
}

void refuse_without_background(const std::string& input, const Sensor& sensor, const Source& source) {
  if (sensor.background.image.empty() && source.frame_count() == 1)
    throw Error(Failure::Input, "an untouched image to compare " + input + " with", "none",
                "--background IMAGE, or \"background\": {\"image\": ...} in the sensor file");
}

/// Most frequent reason of refusal, for the error line when there are too few presses.
std::string main_reason(const BallPresses& found) {
  std::map<BallRefusal, size_t> counts;
  for (const RefusedPress& r : found.refused) ++counts[r.why];
  std::string reason;
  size_t most = 0;
  for (const RefusedPress& r : found.refused)
    if (counts[r.why] > most) most = counts[r.why], reason = r.label + ": " + r.reason;
  return reason;
}

void add(BallPresses& found, BallPress press, const Frame& background) {
  if (!found.presses.empty()) {
    BallPress& last = found.presses.back();
    const FoundBall &a = last.ball, &b = press.ball;
    const bool same_file =
        last.label.substr(0, last.label.rfind('#')) == press.label.substr(0, press.label.rfind('#'));
    if (same_file &&
        std::hypot(a.center_x_px - b.center_x_px, a.center_y_px - b.center_y_px) < kMoved * a.radius_px &&
        std::abs(a.radius_px - b.radius_px) < kDeeper * a.radius_px) {
      if (b.radius_px > a.radius_px) last = std::move(press);
      return;
    }
  }
  if (found.presses.size() >= kMostPresses) return;
  found.presses.push_back(std::move(press));
  found.backgrounds.push_back(background);
}

/// Balls of one size under one light change the colour at one rate; what does not is no such ball.
void refuse_unlike(BallPresses& found) {
  if (found.presses.size() < kEnoughToCompare) return;
  std::vector<FoundBall> balls;
  for (const BallPress& p : found.presses) balls.push_back(p.ball);
  const std::vector<double> usual = usual_ramps(balls, found.format);
  for (size_t i = found.presses.size(); i-- > 0;) {
    const double ratio = found.presses[i].ball.ramp_per_px / usual[i];
    if (ratio < kUnlikeOthers && ratio > 1 / kUnlikeOthers) continue;
    const std::string line =
        text("its colour changes %.2f times as fast as the others': another ball", ratio);
    refuse_press(found, i, line);
  }
}

bool parse(std::string_view text, auto& number) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  return error == std::errc() && end == text.data() + text.size();
}

/// One row of the table: a frame and the ball pressed in it.
struct Row {
  std::string image;  // as written
  fs::path file;
  uint64_t frame = 0;
  std::array<double, 4> numbers{};  // center x, y, contact radius (px), ball radius (mm)
};

/// "name.png" or "name.avi#12" below a folder, "12" of a single file.
void locate(Row& row, const fs::path& input, const std::string& where) {
  const bool folder = fs::is_directory(input);
  const size_t hash = row.image.rfind('#');
  const std::string number =
      hash == std::string::npos ? (folder ? "" : row.image) : row.image.substr(hash + 1);
  const std::string name = hash == std::string::npos ? row.image : row.image.substr(0, hash);
  row.file = folder ? input / name : input;
  if (!number.empty() || !folder) {
    if (!parse(number, row.frame))
      throw Error(
          Failure::Input, "a frame number in " + where, "'" + row.image + "'",
          folder ? "FILE or FILE#FRAME, frames counted from 0" : "the frame's number, counted from 0");
  }
}

std::vector<Row> read_rows(const fs::path& file, const fs::path& input) {
  CsvTable table(file, std::string("a table of pressed balls, columns ") + kBallColumns);
  const std::vector<size_t> columns = table.require(csv_cells(kBallColumns));
  std::vector<Row> rows;
  while (table.next()) {
    Row row;
    row.image = table.cell(columns[0]);
    if (row.image.empty())
      throw Error(Failure::Input, "an image in " + table.where(), "none", "its name or frame number");
    for (size_t i = 0; i < row.numbers.size(); ++i) row.numbers[i] = table.number(columns[i + 1]);
    locate(row, input, table.where());
    rows.push_back(std::move(row));
  }
  if (rows.empty())
    throw Error(Failure::Input, "pressed balls in " + file.string(), "no rows",
                std::string("rows of ") + kBallColumns);
  return rows;
}

}  // namespace

void refuse_press(BallPresses& found, size_t i, const std::string& reason) {
  const auto at = static_cast<std::ptrdiff_t>(i);
  const BallPress& press = found.presses[i];
  found.refused.push_back({press.label, reason, BallRefusal::Unlike, press.ball, press.ball_radius_mm});
  found.frames_with_ball -= std::min<size_t>(found.frames_with_ball, 1);
  found.presses.erase(found.presses.begin() + at);
  found.backgrounds.erase(found.backgrounds.begin() + at);
}

BallPresses find_presses(const std::string& input, const Sensor& sensor, const PressSearch& search,
                         size_t least) {
  const std::unique_ptr<Source> source = open_source(input, sensor);
  if (source->live())
    throw Error(Failure::Input, "a recording of presses", "a camera", "palpate record first");
  refuse_without_background(input, sensor, *source);
  BallPresses found;
  found.format = source->format();
  found.background = load_background(input, sensor, *source);
  const auto* images = dynamic_cast<const ImageSequence*>(source.get());
  const uint64_t count = source->frame_count().value_or(0);
  const uint64_t every =
      search.every > 0 ? search.every : std::max<uint64_t>(1, (count + kMostLooked - 1) / kMostLooked);
  const std::vector<uint8_t> rest_mask =
      search.mask_markers ? find_markers(found.background, sensor) : std::vector<uint8_t>{};
  const BallSearch ball_search{search.ball_radius_mm, sensor.pitch_mm_per_px, sensor.threshold_gray,
                               sensor.channels == 3 ? kLeastInFrame : 1};

  RestCheck rest_check(found.background, sensor);
  PadMatch match(found.background, sensor);
  Frame frame;
  uint64_t looked = 0;
  for (uint64_t n = 0; source->next(frame); ++n) {
    if (n % every != 0) continue;
    if (search.progress && search.progress(++looked, count / every)) break;
    rest_check.add(frame);
    BallPress press;
    press.label = images ? images->files()[n].filename().string() : "frame #" + std::to_string(n);
    press.ball_radius_mm = search.ball_radius_mm;
    if (std::string why = match.look_at(frame); !why.empty()) {
      found.refused.push_back({press.label, std::move(why), BallRefusal::Foreign, {}, search.ball_radius_mm});
      continue;
    }
    press.mask = rest_mask;
    if (!rest_mask.empty()) press.mask = either(find_markers(frame, sensor), rest_mask);
    press.ball = sensor.channels == 3
                     ? find_ball(frame, found.background, press.mask, ball_search)
                     : find_gray_ball(frame, found.background, press.mask, sensor.signal, ball_search);
    if (press.ball.good()) {
      press.frame = frame;
      ++found.frames_with_ball;
      add(found, std::move(press), found.background);
    } else if (press.ball.why == BallRefusal::Untouched) {
      ++found.untouched;
    } else {
      found.refused.push_back(
          {press.label, press.ball.refusal, press.ball.why, press.ball, search.ball_radius_mm});
    }
  }
  match.refuse_most(input);
  found.warning = rest_check.warning();
  if (sensor.channels == 3) refuse_unlike(found);
  if (search.judge) search.judge(found);
  if (found.presses.size() < least) {
    std::string what = std::to_string(found.presses.size()) + " usable";
    what += ", " + count_text(found.untouched, "untouched frame") + ", " +
            std::to_string(found.refused.size()) + " refused";
    if (!found.refused.empty()) what += " (" + main_reason(found) + ")";
    throw Error(Failure::Input,
                (least == 1 ? "a press" : std::to_string(least) + " presses or more") +
                    text(" of a ball of %.4g mm radius in ", search.ball_radius_mm) + input,
                what,
                !found.warning.empty() ? "an untouched --background: " + found.warning
                : found.untouched > 0 && found.refused.empty()
                    ? "presses deep enough to be seen, and an untouched --background"
                    : "single presses of one ball away from the border, or --balls TABLE");
  }
  return found;
}

BallPresses read_presses(const fs::path& file, const fs::path& input, const Sensor& sensor,
                         bool mask_markers) {
  std::vector<Row> rows = read_rows(file, input);
  std::stable_sort(rows.begin(), rows.end(), [](const Row& a, const Row& b) {
    return std::tie(a.file, a.frame) < std::tie(b.file, b.frame);
  });
  BallPresses found;
  // Each file is opened once and read to the last frame that it is wanted for.
  for (size_t i = 0; i < rows.size();) {
    const fs::path from = rows[i].file;
    const std::unique_ptr<Source> source = open_source(from.string(), sensor);
    refuse_without_background(from.string(), sensor, *source);
    const Frame background = load_background(from.string(), sensor, *source);
    if (found.presses.empty()) {
      found.format = source->format();
      found.background = background;
    }
    const std::vector<uint8_t> rest_mask =
        mask_markers ? find_markers(background, sensor) : std::vector<uint8_t>{};
    Frame frame;
    uint64_t next = 0;
    for (; i < rows.size() && rows[i].file == from; ++i) {
      const Row& row = rows[i];
      bool there = next > row.frame;
      while (next <= row.frame && (there = source->next(frame))) ++next;
      if (!there || next != row.frame + 1)
        throw Error(Failure::Input, "frame " + std::to_string(row.frame) + " of " + from.string(),
                    std::to_string(next) + " frames", "frame numbers counted from 0");
      BallPress press;
      press.label = row.image;
      press.frame = frame;
      press.ball.center_x_px = row.numbers[0];
      press.ball.center_y_px = row.numbers[1];
      press.ball.radius_px = row.numbers[2];
      press.ball_radius_mm = row.numbers[3];
      if (!rest_mask.empty()) press.mask = either(find_markers(frame, sensor), rest_mask);
      found.presses.push_back(std::move(press));
      found.backgrounds.push_back(background);
      ++found.frames_with_ball;
    }
  }
  return found;
}

}  // namespace palpate

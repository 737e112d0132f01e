#include "capture/calibrate/photometric/presses.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <map>
#include <memory>
#include <numbers>
#include <optional>
#include <span>
#include <tuple>

#include "capture/calibrate/frame/markers.h"
#include "capture/calibrate/photometric/pad_match.h"
#include "capture/calibrate/photometric/shape_text.h"
#include "capture/calibrate/photometric/still_noise.h"
#include "capture/files/image_sequence.h"
#include "capture/files/images/images.h"
#include "capture/files/tables/csv_table.h"
#include "capture/open_source.h"
#include "capture/run/rest_check.h"
#include "engine/base/text.h"
#include "engine/calibrate/ball/ramp.h"
#include "engine/calibrate/photometric/fit.h"
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

/// Masks what the other contacts in the picture do around them.
void mask_others(std::span<const FoundBall> contacts, size_t own, const FrameFormat& format,
                 std::vector<uint8_t>& mask) {
  if (contacts.size() < 2) return;
  mask.resize(size_t{format.width} * format.height);
  for (uint32_t y = 0; y < format.height; ++y)
    for (uint32_t x = 0; x < format.width; ++x) {
      if (offset_from(contacts[own], x, y).px < contacts[own].radius_px) continue;
      for (size_t i = 0; i < contacts.size(); ++i)
        if (i != own && offset_from(contacts[i], x, y).px < PhotometricFit::kRestRing * contacts[i].radius_px)
          mask[size_t{y} * format.width + x] = 1;
    }
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
  if (found.presses.size() < kEnoughToCompare || !found.presses.front().shape.round()) return;
  std::vector<FoundBall> balls;
  for (const BallPress& p : found.presses) balls.push_back(p.ball);
  const std::vector<double> usual = usual_ramps(balls, found.format);
  for (size_t i = found.presses.size(); i-- > 0;) {
    const double ratio = found.presses[i].ball.ramp_per_px / usual[i];
    if (ratio < kUnlikeOthers && ratio > 1 / kUnlikeOthers) continue;
    const std::string line = text("its colour changes %.2f times as fast as the others': another %s", ratio,
                                  name_of(found.presses[i].shape.kind));
    refuse_press(found, i, line);
  }
}

bool parse(std::string_view text, auto& number) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  return error == std::errc() && end == text.data() + text.size();
}

/// One row of the table: a frame and what is pressed in it.
struct Row {
  std::string image;  // as written
  fs::path file;
  uint64_t frame = 0;
  FoundBall contact;
  PressedShape shape;
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

/// Shape of a row, and of a cylinder how it lies.
void read_shape(const CsvTable& table, Row& row) {
  const auto cell = [&](const char* name) {
    const std::optional<size_t> column = table.find(name);
    return column && !table.cell(*column).empty() ? column : std::nullopt;
  };
  const auto needed = [&](const char* name, const char* what) {
    if (const std::optional<size_t> column = cell(name)) return table.number(*column);
    throw Error(Failure::Input, std::string(name) + " in " + table.where(), "none", what);
  };
  const std::optional<size_t> shape = cell("shape");
  if (!shape) {
    row.shape = PressedShape::ball(needed("ball_radius_mm", "the ball's radius, or a column 'shape'"));
    return;
  }
  row.shape = parse_shape(table.cell(*shape), table.where(), Failure::Input);
  if (row.shape.apart_mm > 0)
    throw Error(Failure::Input, "one shape a row in " + table.where(), "'" + table.cell(*shape) + "'",
                "a row for each dot, ball:radius=MM");
  if (row.shape.round()) return;
  row.contact.axis_rad = needed("axis_deg", "the direction of the cylinder's axis") * std::numbers::pi / 180;
  row.contact.half_length_px = needed("length_px", "the contact's length along the cylinder") / 2;
  if (row.contact.half_length_px < 1.5 * row.contact.radius_px)
    throw Error(Failure::Input, "a cylinder's contact that is longer than wide in " + table.where(),
                text("%.4g px long, %.4g wide", 2 * row.contact.half_length_px, 2 * row.contact.radius_px),
                "contact_radius_px as half of the width, length_px as the whole length");
}

std::vector<Row> read_rows(const fs::path& file, const fs::path& input) {
  CsvTable table(file, std::string("a table of presses, columns ") + kBallColumns);
  std::vector<std::string> wanted = csv_cells(kBallColumns);
  if (table.find("shape")) wanted.pop_back();  // the radius
  const std::vector<size_t> columns = table.require(wanted);
  std::vector<Row> rows;
  while (table.next()) {
    Row row;
    row.image = table.cell(columns[0]);
    if (row.image.empty())
      throw Error(Failure::Input, "an image in " + table.where(), "none", "its name or frame number");
    row.contact.center_x_px = table.number(columns[1]);
    row.contact.center_y_px = table.number(columns[2]);
    row.contact.radius_px = table.number(columns[3]);
    read_shape(table, row);
    locate(row, input, table.where());
    rows.push_back(std::move(row));
  }
  if (rows.empty())
    throw Error(Failure::Input, "presses in " + file.string(), "no rows",
                std::string("rows of ") + kBallColumns);
  return rows;
}

}  // namespace

void refuse_press(BallPresses& found, size_t i, const std::string& reason) {
  const auto at = static_cast<std::ptrdiff_t>(i);
  const BallPress& press = found.presses[i];
  found.refused.push_back({press.label, reason, BallRefusal::Unlike, press.ball, press.shape});
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
  const BallSearch ball_search{search.shape, sensor.pitch_mm_per_px, sensor.threshold_gray,
                               sensor.channels == 3 ? kLeastInFrame : 1};

  RestCheck rest_check(found.background, sensor);
  PadMatch match(found.background, sensor);
  StillNoise still;
  Frame frame;
  uint64_t looked = 0;
  for (uint64_t n = 0; source->next(frame); ++n) {
    if (n % every != 0) continue;
    if (search.progress && search.progress(++looked, count / every)) break;
    rest_check.add(frame);
    BallPress press;
    press.label = images ? images->files()[n].filename().string() : "frame #" + std::to_string(n);
    press.shape = search.shape;
    press.shape.apart_mm = 0;  // each dot is a press of a ball
    if (std::string why = match.look_at(frame); !why.empty()) {
      found.refused.push_back({press.label, std::move(why), BallRefusal::Foreign, {}, search.shape});
      continue;
    }
    press.mask = rest_mask;
    press.markers = !rest_mask.empty();
    if (!rest_mask.empty()) press.mask = either(find_markers(frame, sensor), rest_mask);
    std::vector<FoundBall> contacts;
    if (sensor.channels != 3)
      contacts = {find_gray_ball(frame, found.background, press.mask, sensor.signal, ball_search)};
    else if (search.shape.apart_mm > 0)
      contacts = find_dots(frame, found.background, press.mask, ball_search);
    else
      contacts = {find_contact(frame, found.background, press.mask, ball_search)};
    if (contacts.size() == 1 && contacts[0].why == BallRefusal::Untouched) {
      ++found.untouched;
      if (sensor.channels == 3) still.add(frame);
      continue;
    }
    const std::string picture = press.label;
    for (size_t i = 0; i < contacts.size(); ++i) {
      if (search.shape.apart_mm > 0) press.label = picture + " dot " + std::to_string(i + 1);
      const FoundBall& contact = contacts[i];
      if (!contact.good()) {
        found.refused.push_back({press.label, contact.refusal, contact.why, contact, press.shape});
        continue;
      }
      BallPress one = press;
      one.ball = contact;
      one.frame = frame;
      mask_others(contacts, i, frame.format, one.mask);
      ++found.frames_with_ball;
      add(found, std::move(one), found.background);
    }
  }
  match.refuse_most(input);
  found.frame_sd = still.sd();
  found.warning = rest_check.warning();
  if (sensor.channels == 3) refuse_unlike(found);
  if (search.judge) search.judge(found);
  if (found.presses.size() < least) {
    std::string what = std::to_string(found.presses.size()) + " usable";
    what += ", " + count_text(found.untouched, "untouched frame") + ", " +
            std::to_string(found.refused.size()) + " refused";
    if (!found.refused.empty()) what += " (" + main_reason(found) + ")";
    throw Error(Failure::Input,
                (least == 1 ? "a press" : std::to_string(least) + " presses or more") + " of " +
                    describe(search.shape) + " in " + input,
                what,
                !found.warning.empty() ? "an untouched --background: " + found.warning
                : found.untouched > 0 && found.refused.empty()
                    ? "presses deep enough to be seen, and an untouched --background"
                : search.shape.apart_mm > 0
                    ? "the dots' own size and distance, whole in the picture, with level pad between them"
                    : std::string("single presses of one ") + name_of(search.shape.kind) +
                          " away from the border, or --balls TABLE");
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
    const size_t first = i;
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
      press.ball = row.contact;
      press.shape = row.shape;
      press.markers = !rest_mask.empty();
      if (press.markers) press.mask = either(find_markers(frame, sensor), rest_mask);
      std::vector<FoundBall> contacts{row.contact};
      for (size_t k = first; k < rows.size() && rows[k].file == from; ++k)
        if (k != i && rows[k].frame == row.frame) contacts.push_back(rows[k].contact);
      mask_others(contacts, 0, frame.format, press.mask);
      found.presses.push_back(std::move(press));
      found.backgrounds.push_back(background);
      ++found.frames_with_ball;
    }
  }
  return found;
}

}  // namespace palpate

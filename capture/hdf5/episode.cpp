#include "capture/hdf5/episode.h"

#include <unistd.h>

#include <algorithm>
#include <cstring>
#include <limits>
#include <set>

#include "palpate/error.h"
#include "palpate/version.h"

namespace palpate {
namespace {

constexpr size_t kSkinNumbers = 5;
constexpr const char* kSkinText =
    "Places of the skin's pattern: x and y in the untouched image, shift from there in x and y, px, and the "
    "correlation, 0 to 1 (0: lost, its shift is not known).";

template <typename Of>
bool is_there(const MeasuredQuantity<Of>& q, MeasuredColumns columns) {
  return (columns.groups & q.group) != 0;
}

double number_of(const QuantityValue& value) {
  if (const bool* flag = std::get_if<bool>(&value)) return *flag ? 1 : 0;
  if (const uint64_t* count = std::get_if<uint64_t>(&value)) return static_cast<double>(*count);
  if (const double* number = std::get_if<double>(&value)) return *number;
  return std::numeric_limits<double>::quiet_NaN();
}

}  // namespace

EpisodeFile::EpisodeFile(std::filesystem::path file)
    : file_(std::move(file)),
      partial_(file_.parent_path() /
               ("." + file_.filename().string() + "." + std::to_string(::getpid()) + ".partial")),
      writer_(write_hdf5(partial_)) {
  writer_->attribute("program_version", PALPATE_VERSION_TEXT);
}

Episode::Episode(EpisodeFile& file, const EpisodeOptions& options)
    : writer_(&file.writer()),
      root_(options.side.empty() ? "" : "/" + options.side),
      columns_(options.columns),
      frames_(add_stream("/frames")),
      touches_(add_stream("/touch")) {
  const FrameFormat& f = options.format;
  std::vector<uint64_t> sides = {f.height, f.width};
  const std::vector<uint64_t> map = sides;
  if (f.channels == 3) sides.push_back(3);
  images_ = writer_->add({root_ + "/frames/image", f.bit_depth > 8 ? Hdf5Type::U16 : Hdf5Type::U8, sides,
                          "gray levels", "Frames as they were measured; colour as red, green, blue."});
  if (wants(options.outputs, Output::Surface))
    depth_ = Map{add_stream("/depth"),
                 writer_->add({root_ + "/depth/depth_mm", Hdf5Type::F32, map, "mm",
                               "Depth below the rest level, row by row; NaN where it is not known."})};
  add_columns(touch_quantities());
  const std::string begin = options.side.empty() ? "" : options.side + "_";
  for (const auto& [name, text] : options.facts) writer_->attribute(begin + name, text);
  writer_->attribute(begin + "sensor_name", options.sensor.name);
  if (has_scale(options.sensor)) writer_->attribute(begin + "sensor", sensor_text(options.sensor));
}

EpisodeFile::~EpisodeFile() {
  if (!writer_) return;
  writer_.reset();
  ::unlink(partial_.c_str());
}

Episode::Stream Episode::add_stream(const std::string& group) {
  return {writer_->add(
              {root_ + group + "/time_s", Hdf5Type::F64, {}, "s", "Of exposure, since the recording began."}),
          writer_->add({root_ + group + "/frame", Hdf5Type::U64, {}, "", "Number of the frame."})};
}

void Episode::stamp(const Stream& stream, const Touch& touch, double time_s) {
  writer_->append(stream.time, &time_s);
  writer_->append(stream.frame, &touch.sequence);
}

template <typename Of>
void Episode::add_columns(std::span<const MeasuredQuantity<Of>> quantities) {
  const auto add = [&](const std::string& name, Hdf5Type type, const char* unit, const std::string& text) {
    values_[name] = writer_->add({root_ + "/touch/" + name, type, {}, unit, text});
  };
  for (const MeasuredQuantity<Of>& q : quantities) {
    if (!is_there(q, columns_)) continue;
    add(q.name, q.kind == QuantityKind::Word ? Hdf5Type::Text : Hdf5Type::F64, q.unit, q.sentence);
    if (q.kind != QuantityKind::Estimated) continue;
    add(error_name(q), Hdf5Type::F64, q.unit, std::string("Standard error of ") + q.name + ".");
    if (q.state) add(q.state, Hdf5Type::Text, "", std::string("State of ") + q.name + ": valid, or why not.");
  }
}

template <typename Of>
void Episode::add_values(std::span<const MeasuredQuantity<Of>> quantities, const Of& of) {
  for (const MeasuredQuantity<Of>& q : quantities) {
    if (!is_there(q, columns_)) continue;
    QuantityValue value;
    if (!q.in_table || q.in_table(of)) value = q.value(of);
    if (q.kind == QuantityKind::Word) {
      const auto* word = std::get_if<std::string_view>(&value);
      writer_->append_text(values_.at(q.name), word ? std::string(*word) : "");
      continue;
    }
    const Estimate* shown = shown_estimate(q, value);
    const double none = std::numeric_limits<double>::quiet_NaN();
    const double number = q.kind != QuantityKind::Estimated ? number_of(value) : shown ? shown->value : none;
    writer_->append(values_.at(q.name), &number);
    if (q.kind != QuantityKind::Estimated) continue;
    const double error = shown ? shown->standard_error : none;
    writer_->append(values_.at(error_name(q)), &error);
    const Estimate* estimate = std::get_if<Estimate>(&value);
    if (q.state) writer_->append_text(values_.at(q.state), estimate ? to_string(estimate->validity) : "");
  }
}

void EpisodeFile::add(const NumberTable& table, const std::string& root) {
  const auto plain = [](std::string name) {
    for (char& c : name)
      if (c == '/') c = '_';
    return name == "." || name.empty() ? "_" : name;
  };
  static const std::set<std::string> kTaken = {"frames", "touch", "depth", "skin", "left", "right", "pair"};
  const std::string group =
      root + "/" + (kTaken.contains(table.name) ? "log_" : "") + plain(table.name) + "/";
  const auto add = [&](const std::string& name, const std::string& unit, const std::string& description,
                       std::span<const double> values) {
    const size_t dataset = writer_->add({group + name, Hdf5Type::F64, {}, unit, description});
    for (const double value : values) writer_->append(dataset, &value);
  };
  std::set<std::string> names = {"time_s"};
  add("time_s", "s", "Since the recording began; " + table.origin + ".", table.time_s);
  for (const NumberColumn& column : table.columns) {
    std::string name = plain(column.name);
    while (!names.insert(name).second) name += '_';
    add(name, column.unit, "Column '" + column.name + "' of the log.", column.values);
  }
}

void Episode::add_image(const Frame& frame) {
  const FrameFormat& f = frame.format;
  if (f.channels == 1) return writer_->append(images_, frame.pixels());
  const size_t pixels = size_t{f.width} * f.height, bytes = f.bytes_per_pixel();
  pixels_.resize(f.frame_bytes());
  for (size_t i = 0; i < pixels; ++i)
    for (size_t c = 0; c < f.channels; ++c)
      std::memcpy(pixels_.data() + (f.channels * i + c) * bytes,
                  frame.pixels() + c * f.plane_bytes() + i * bytes, bytes);
  writer_->append(images_, pixels_.data());
}

void Episode::add_skin(const Touch& touch, double time_s) {
  if (!skin_) {
    skin_points_ = touch.skin_points.size();
    skin_ = Map{
        add_stream("/skin"),
        writer_->add({root_ + "/skin/points", Hdf5Type::F32, {skin_points_, kSkinNumbers}, "px", kSkinText})};
  }
  map_.assign(skin_points_ * kSkinNumbers, std::numeric_limits<float>::quiet_NaN());
  for (size_t i = 0; i < std::min(skin_points_, touch.skin_points.size()); ++i) {
    const SkinPoint& p = touch.skin_points[i];
    const float numbers[] = {p.rest_x_px, p.rest_y_px, p.shift_x_px, p.shift_y_px, p.correlation};
    std::copy_n(numbers, kSkinNumbers, map_.begin() + static_cast<long>(i * kSkinNumbers));
  }
  stamp(skin_->stream, touch, time_s);
  writer_->append(skin_->values, map_.data());
}

void Episode::add(const Frame& frame, const Touch& touch, const std::optional<DepthMap>& depth,
                  double time_s) {
  stamp(frames_, touch, time_s);
  add_image(frame);
  stamp(touches_, touch, time_s);
  add_values(touch_quantities(), touch);
  if (depth && depth_) {
    map_.assign(depth->depth_mm.begin(), depth->depth_mm.end());
    for (size_t i = 0; i < depth->confidence.size(); ++i)
      if ((depth->confidence[i] & 0xff) == 0) map_[i] = std::numeric_limits<float>::quiet_NaN();
    stamp(depth_->stream, touch, time_s);
    writer_->append(depth_->values, map_.data());
  }
  if (!touch.skin_points.empty()) add_skin(touch, time_s);
}

void EpisodeFile::commit() {
  writer_->close();
  writer_.reset();
  std::error_code code;
  std::filesystem::rename(partial_, file_, code);
  if (!code) return;
  ::unlink(partial_.c_str());
  throw Error(Failure::Output, "to write '" + file_.string() + "'", code.message(), "another place");
}

}  // namespace palpate

#include "capture/files/measurements.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <span>
#include <utility>

#include "capture/files/csv_table.h"
#include "engine/base/json.h"
#include "engine/sensor/fit.h"
#include "palpate/pipeline.h"

namespace palpate {
namespace {

using Group = MeasuredColumns::Group;

struct Column {
  const char* name;
  uint32_t group;
};

constexpr Column kFrame[] = {{"frame", Group::Frame}, {"time_s", Group::Time}, {"source", Group::Source}};
// A measured length is in one of two columns: millimetres, or pixels where no scale is known.
constexpr Column kMeasured[] = {{"contact", Group::Touching},
                                {"gray_sum", Group::Touching},
                                {"force_N", Group::Force},
                                {"force_sd_N", Group::Force},
                                {"force_state", Group::Force},
                                {"centroid_x_px", Group::Touching},
                                {"centroid_y_px", Group::Touching},
                                {"area_px", Group::Touching},
                                {"area_mm2", Group::Millimetres},
                                {"ellipse_major_mm", Group::Millimetres},
                                {"ellipse_major_px", Group::Pixels},
                                {"ellipse_minor_mm", Group::Millimetres},
                                {"ellipse_minor_px", Group::Pixels},
                                {"ellipse_angle_rad", Group::Touching},
                                {"peak_gray", Group::Touching},
                                {"saturated_px", Group::Touching},
                                {"shear_x_N", Group::Shear},
                                {"shear_x_sd_N", Group::Shear},
                                {"shear_y_N", Group::Shear},
                                {"shear_y_sd_N", Group::Shear},
                                {"shear_state", Group::Shear},
                                {"shift_x_mm", Group::ShiftMillimetres},
                                {"shift_x_px", Group::ShiftPixels},
                                {"shift_y_mm", Group::ShiftMillimetres},
                                {"shift_y_px", Group::ShiftPixels},
                                {"slip", Group::Slipping},
                                {"depth_max_mm", Group::Depth},
                                {"depth_sd_mm", Group::DepthError},
                                {"depth_state", Group::Depth},
                                {"depth_reference", Group::Depth},
                                {"unknown_px", Group::Confidence},
                                {"shadowed_px", Group::Confidence},
                                {"outside_px", Group::Confidence},
                                {"islands", Group::Weighted},
                                {"weighted_residual", Group::Weighted},
                                {"weighted_misfit", Group::Weighted},
                                {"clipped_px", Group::Depth},
                                {"contacts", Group::Contacts},
                                {"volume_mm3", Group::Depth},
                                {"dented_mm2", Group::Dented},
                                {"skin_points", Group::Skin},
                                {"skin_lost", Group::Skin},
                                {"skin_shift_x_mm", Group::Skin},
                                {"skin_shift_x_sd_mm", Group::Skin},
                                {"skin_shift_y_mm", Group::Skin},
                                {"skin_shift_y_sd_mm", Group::Skin},
                                {"torsion_rad", Group::Skin},
                                {"torsion_sd_rad", Group::Skin},
                                {"stick_share", Group::Skin},
                                {"stick_share_sd", Group::Skin},
                                {"gradient_sum", Group::Gradient},
                                {"light_state", Group::Light},
                                {"light_change_gray", Group::Light},
                                {"wrench_fx_N", Group::Traction},
                                {"wrench_fx_sd_N", Group::Traction},
                                {"wrench_fy_N", Group::Traction},
                                {"wrench_fy_sd_N", Group::Traction},
                                {"wrench_fz_N", Group::Traction},
                                {"wrench_fz_sd_N", Group::Traction},
                                {"wrench_mx_Nmm", Group::Traction},
                                {"wrench_mx_sd_Nmm", Group::Traction},
                                {"wrench_my_Nmm", Group::Traction},
                                {"wrench_my_sd_Nmm", Group::Traction},
                                {"wrench_mz_Nmm", Group::Traction},
                                {"wrench_mz_sd_Nmm", Group::Traction},
                                {"wrench_state", Group::Traction},
                                {"pressure_max_kPa", Group::Traction},
                                {"shear_max_kPa", Group::Traction},
                                {"pressed_area_mm2", Group::Traction},
                                {"unexplained_slope", Group::Traction}};
constexpr Column kTrue[] = {{"true_contact", Group::Truth},      {"true_force_N", Group::Truth},
                            {"true_shear_x_N", Group::Truth},    {"true_shear_y_N", Group::Truth},
                            {"true_slip", Group::Truth},         {"true_center_x_px", Group::Truth},
                            {"true_center_y_px", Group::Truth},  {"true_radius_px", Group::Truth},
                            {"true_depth_max_mm", Group::Truth}, {"depth_rms_error_mm", Group::Truth},
                            {"true_contacts", Group::Truth},     {"true_volume_mm3", Group::Truth},
                            {"true_torsion_rad", Group::Truth},  {"true_stick_share", Group::Truth}};
constexpr Column kContactId[] = {{"id", Group::Frame}, {"frames", Group::Frame}};
constexpr Column kContactPlace[] = {{"at_border", Group::Frame},
                                    {"box_x_px", Group::Frame},
                                    {"box_y_px", Group::Frame},
                                    {"box_width_px", Group::Frame},
                                    {"box_height_px", Group::Frame}};
// From gray_sum to slip: what a contact has as the whole touch has it.
constexpr std::span<const Column> kShape(kMeasured + 1, 25);

// Places of numbers that have no error of their own, see Digits.
constexpr int kGrayPlaces = 2, kForcePlaces = 4, kPixelPlaces = 2, kLengthPlaces = 4, kAnglePlaces = 4,
              kTimePlaces = 6, kRatioPlaces = 6, kSumPlaces = 1;
constexpr int kAllPlaces = -1;

/// Builds a row cell by cell, in the columns' order; the cells of columns that are not there are dropped.
class Row {
 public:
  enum class Form : uint8_t { Csv, Json };
  Row(Form form, MeasuredColumns columns, Digits digits) : form_(form), columns_(columns), digits_(digits) {}

  /// The columns of the cells that follow.
  Row& section(std::span<const Column> columns) {
    section_ = columns;
    next_ = 0;
    return *this;
  }
  void text(const std::string& value) {
    put(value.empty() || form_ == Form::Csv ? value : json::Value(value).dump(-1, json::Utf8::Replace));
  }
  void empty() { put(""); }
  void whole(uint64_t value) { put(std::to_string(value)); }
  void whole_if(bool known, uint64_t value) { known ? whole(value) : empty(); }
  void number(double value, int places) {
    if (!std::isfinite(value)) return empty();
    const bool all = digits_ == Digits::All || places == kAllPlaces;
    put(all ? shortest(value) : with_places(value, places));
  }
  void number_if(bool known, double value, int places) { known ? number(value, places) : empty(); }
  /// Two cells.
  void estimate_if(bool known, double value, double error, int places) {
    if (error > 0 && std::isfinite(error)) places = deserved_places(error);
    number_if(known, value, places);
    number_if(known, error, places);
  }
  void estimate(const Estimate& e, int places) {
    estimate_if(has_value(e), e.value, e.standard_error, places);
  }
  /// Two columns, one of which is there.
  void length_if(bool known, double mm, double px) {
    number_if(known, mm, kLengthPlaces);
    number_if(known, px, kPixelPlaces);
  }
  bool has(Group group) const { return (columns_.groups & group) != 0; }
  const std::string& line() const { return line_; }

 private:
  void put(const std::string& value) {
    const Column& column = section_[next_++];
    if (!(columns_.groups & column.group)) return;
    if (form_ == Form::Json) {
      if (!value.empty()) line_ += (line_.empty() ? "\"" : ",\"") + std::string(column.name) + "\":" + value;
      return;
    }
    if (!first_) line_ += ',';
    first_ = false;
    line_ += value;
  }

  Form form_;
  MeasuredColumns columns_;
  Digits digits_;
  std::span<const Column> section_;
  size_t next_ = 0;
  std::string line_;
  bool first_ = true;
};

void add_names(std::string& line, std::span<const Column> columns, uint32_t groups) {
  for (const Column& column : columns)
    if (groups & column.group) line += (line.empty() ? "" : ",") + std::string(column.name);
}

void add_frame(Row& row, const Touch& touch, const std::string& source) {
  row.section(kFrame);
  row.whole(touch.sequence);
  row.number(static_cast<double>(touch.time_ns) / 1e9, kTimePlaces);
  row.text(source);
}

// Cells common to a frame's whole touch and one contact. `single`: it is one contact's; `seen`: its picture
// was whole.
template <typename Shape>
void add_shape(Row& row, const Shape& shape, bool single, bool seen = true) {
  row.number(shape.gray_sum, kSumPlaces);
  row.estimate(shape.force_N, kForcePlaces);
  row.text(to_string(shape.force_N.validity));
  row.number_if(single, shape.centroid_x_px, kPixelPlaces);
  row.number_if(single, shape.centroid_y_px, kPixelPlaces);
  row.whole_if(seen, shape.area_px);
  row.number(shape.area_mm2, kLengthPlaces);
  row.length_if(single, shape.ellipse.major_mm, shape.ellipse.major_px);
  row.length_if(single, shape.ellipse.minor_mm, shape.ellipse.minor_px);
  row.number_if(single, shape.ellipse.angle_rad, kAnglePlaces);
  row.number(shape.peak_gray, kGrayPlaces);
  row.whole_if(seen, shape.saturated_px);
  row.estimate(shape.shear_x_N, kForcePlaces);
  row.estimate(shape.shear_y_N, kForcePlaces);
  row.text(to_string(shape.shear_x_N.validity));
  row.length_if(single, shape.shift_x_mm, shape.shift_x_px);
  row.length_if(single, shape.shift_y_mm, shape.shift_y_px);
  row.text(to_string(shape.slip));
}

// More regions than there was room for: how many contacts there are is not known.
bool counted(const Touch& touch) {
  return touch.regions && !touch.regions->overflow;
}

void add_skin(Row& row, const Touch& touch) {
  const SkinMotion skin = touch.skin.value_or(SkinMotion{});
  for (const uint32_t points : {skin.points, skin.lost}) row.whole_if(touch.skin.has_value(), points);
  for (const auto& [one, places] : {std::pair{&skin.shift_x_mm, kLengthPlaces},
                                    {&skin.shift_y_mm, kLengthPlaces},
                                    {&skin.torsion_rad, kAnglePlaces},
                                    {&skin.stick_fraction, kAnglePlaces}})
    row.estimate_if(touch.skin && has_value(*one), one->value, one->standard_error, places);
}

void add_traction(Row& row, const Touch& touch) {
  const TractionSummary t = touch.traction.value_or(TractionSummary{});
  for (const Estimate* one :
       {&t.force_x_N, &t.force_y_N, &t.force_z_N, &t.moment_x_Nmm, &t.moment_y_Nmm, &t.moment_z_Nmm})
    row.estimate_if(touch.traction && has_value(*one), one->value, one->standard_error, kForcePlaces);
  row.text(touch.traction ? to_string(t.force_z_N.validity) : "");
  const bool pressed = touch.traction && has_value(t.force_z_N);
  row.number_if(pressed, t.pressure_max_kPa, kGrayPlaces);
  row.number_if(pressed && has_value(t.force_x_N), t.shear_max_kPa, kGrayPlaces);
  row.number_if(pressed, t.area_mm2, kGrayPlaces);
  row.number_if(pressed && t.unexplained_slope > 0, t.unexplained_slope, kLengthPlaces);
}

void add_measured(Row& row, const Touch& touch, bool touching) {
  row.section(kMeasured);
  const bool seen = touch.picture == PictureFault::None;
  if (touching) {
    row.whole_if(seen, touch.contact ? 1 : 0);
    add_shape(row, touch, touch.contact && touch.contacts.size() < 2, seen);
  } else {
    for (size_t i = 0; i < 1 + kShape.size(); ++i) row.empty();
  }
  const SurfaceSummary surface = touch.surface.value_or(SurfaceSummary{});
  const double depth_sd_mm = surface.depth_sd_mm;
  const int depth_places = depth_sd_mm > 0 ? deserved_places(depth_sd_mm) : kLengthPlaces;
  row.number_if(touch.surface.has_value(), surface.depth_max_mm, depth_places);
  row.number_if(touch.surface && depth_sd_mm > 0, depth_sd_mm, depth_places);
  row.text(touch.surface ? to_string(surface.validity) : "");
  row.text(!touch.surface || !seen ? "" : surface.rest_from_untouched ? "rest" : "mean");
  const ConfidenceSummary confidence = touch.confidence.value_or(ConfidenceSummary{});
  for (const uint64_t count : {confidence.unknown_px, confidence.shadowed_px, confidence.outside_px})
    row.whole_if(touch.confidence.has_value(), count);
  const WeightedSummary weighted = surface.weighted.value_or(WeightedSummary{});
  row.whole_if(surface.weighted.has_value(), weighted.islands);
  row.number_if(weighted.residual.has_value(), weighted.residual.value_or(0), kRatioPlaces);
  row.number_if(weighted.unexplained.has_value(), weighted.unexplained.value_or(0), kRatioPlaces);
  row.whole_if(seen && touch.surface, surface.clipped_px);
  row.whole_if(counted(touch), touch.contacts.size());
  row.number_if(touch.surface.has_value(), surface.volume_mm3, kLengthPlaces);
  row.number_if(surface.dented_mm2.has_value(), surface.dented_mm2.value_or(0), kLengthPlaces);
  add_skin(row, touch);
  row.number_if(touch.gradient_sum.has_value(), touch.gradient_sum.value_or(0), kSumPlaces);
  row.text(touch.light ? to_string(touch.light->state) : "");
  row.number_if(touch.light.has_value(), touch.light.value_or(LightSummary{}).change_gray, kGrayPlaces);
  add_traction(row, touch);
}

void add_truth(Row& row, const Truth* truth, std::optional<double> depth_rms_error_mm) {
  row.section(kTrue);
  if (!truth) {
    for (size_t i = 0; i < std::size(kTrue); ++i) row.empty();
    return;
  }
  row.whole(truth->contact ? 1 : 0);
  row.number(truth->force_N, kAllPlaces);
  row.number(truth->shear_x_N, kAllPlaces);
  row.number(truth->shear_y_N, kAllPlaces);
  row.whole(truth->slipping ? 1 : 0);
  row.number_if(truth->contact, truth->center_x_px, kAllPlaces);
  row.number_if(truth->contact, truth->center_y_px, kAllPlaces);
  row.number(truth->radius_px, kAllPlaces);
  row.number(truth->indentation_mm, kAllPlaces);
  row.number_if(depth_rms_error_mm.has_value(), depth_rms_error_mm.value_or(0), kRatioPlaces);
  // A scene with one contact may leave the list to its single fields.
  row.whole(truth->contacts.empty() ? (truth->contact ? 1 : 0) : truth->contacts.size());
  row.number(truth->volume_mm3, kAllPlaces);
  row.number(truth->torsion_rad, kAllPlaces);
  row.number_if(truth->contact, truth->stick_fraction, kAllPlaces);
}

void add_contact(Row& row, const ContactTouch& contact) {
  row.section(kContactId);
  row.whole(contact.id);
  row.whole(contact.frames);
  row.section(kShape);
  add_shape(row, contact, true);
  row.section(kContactPlace);
  row.whole(contact.at_border ? 1 : 0);
  for (const uint32_t side : {contact.box.x, contact.box.y, contact.box.width, contact.box.height})
    row.whole(side);
}

}  // namespace

std::string shortest(double value) {
  char text[40];
  const auto end = std::to_chars(text, text + sizeof text, value).ptr;
  return std::string(text, end);
}

std::string with_places(double value, int places) {
  char text[400];
  const auto end = std::to_chars(text, text + sizeof text, value, std::chars_format::fixed, places).ptr;
  std::string written(text, end);
  if (written.front() == '-' && written.find_first_not_of("-0.") == std::string::npos) written.erase(0, 1);
  return written;
}

int deserved_places(double error) {
  constexpr int kMost = 9;
  // 0.0996 has the two digits 0.10.
  const double two = error * 1.00251;
  return std::clamp(1 - static_cast<int>(std::floor(std::log10(two))), 0, kMost);
}

bool has_value(const Estimate& estimate) {
  return estimate.validity != Validity::NotCalibrated && estimate.validity != Validity::NoContact &&
         estimate.validity != Validity::PictureDamaged && estimate.validity != Validity::NotFollowed;
}

MeasuredColumns MeasuredColumns::of(const Sensor& sensor, uint32_t outputs, bool separate) {
  MeasuredColumns columns{Frame | Time};
  const auto add = [&columns](bool there, uint32_t groups) { columns.groups |= there ? groups : 0; };
  const bool touching = wants(outputs, Output::Force), surface = wants(outputs, Output::Surface);
  const bool skin = !separate && follows_skin(sensor, wants(outputs, Output::Skin), touching);
  const bool confidence =
      wants(outputs, Output::Confidence) || (surface && (sensor.pad || sensor.shadow_gray));
  const bool gradient = sensor.force && sensor.force->signal == ForceSignal::Gradient;
  add(touching, Touching);
  add(touching, has_scale(sensor) ? Millimetres : Pixels);
  add(touching && sensor.force, Force);
  add(touching && !separate, has_scale(sensor) ? ShiftMillimetres : ShiftPixels);
  add(touching && !separate && sensor.shear, Shear);
  add(touching && !separate && (sensor.shear || skin), Slipping);
  add(surface, Depth);
  add(surface && wants(outputs, Output::Contacts) && has_gel_contacts(sensor), Dented);
  add(surface && (sensor.reconstruction == Reconstruction::Elastic || sensor.lookup.depth_sd_mm > 0),
      DepthError);
  add(confidence, Confidence);
  add(surface && confidence, Weighted);
  add(wants(outputs, Output::Contacts), Contacts);
  add(skin, Skin);
  add(wants(outputs, Output::Gradient) || (touching && gradient), Gradient);
  add(follows_light(sensor), Light);
  add(wants(outputs, Output::Traction), Traction);
  return columns;
}

std::string Measurements::header(MeasuredColumns columns) {
  std::string line;
  for (const std::span<const Column> section :
       {std::span<const Column>(kFrame), std::span<const Column>(kMeasured), std::span<const Column>(kTrue)})
    add_names(line, section, columns.groups);
  return line;
}

std::string Measurements::cell_names() {
  std::string line;
  add_names(line, kMeasured, MeasuredColumns::kAll);
  return line;
}

Measurements::Measurements(const std::filesystem::path& file, MeasuredColumns columns, Digits digits)
    : file_(file), columns_(columns), digits_(digits) {
  file_.append(header(columns));
}

std::string Measurements::cells(const Touch& touch, uint32_t outputs) {
  Row row(Row::Form::Csv, {}, Digits::All);
  add_measured(row, touch, wants(outputs, Output::Force));
  return row.line();
}

std::string Measurements::row(const Touch& touch, MeasuredColumns columns, Digits digits, const Truth* truth,
                              std::optional<double> depth_rms_error_mm, const std::string& source) {
  Row row(Row::Form::Csv, columns, digits);
  add_frame(row, touch, csv_cell(source));
  add_measured(row, touch, row.has(Group::Touching));
  add_truth(row, truth, depth_rms_error_mm);
  return row.line();
}

void Measurements::add(const Touch& touch, const Truth* truth, std::optional<double> depth_rms_error_mm,
                       const std::string& source) {
  file_.append(row(touch, columns_, digits_, truth, depth_rms_error_mm, source));
}

ContactRows::ContactRows(const std::filesystem::path& file, MeasuredColumns columns, Digits digits)
    : file_(file), columns_(columns), digits_(digits) {
  file_.append(header(columns));
}

std::string ContactRows::header(MeasuredColumns columns) {
  std::string line;
  for (const std::span<const Column> section :
       {std::span<const Column>(kFrame), std::span<const Column>(kContactId), kShape,
        std::span<const Column>(kContactPlace)})
    add_names(line, section, columns.groups);
  return line;
}

void ContactRows::add(const Touch& touch, const std::string& source) {
  for (const ContactTouch& contact : touch.contacts) {
    Row row(Row::Form::Csv, columns_, digits_);
    add_frame(row, touch, csv_cell(source));
    add_contact(row, contact);
    file_.append(row.line());
  }
}

std::string json_line(const Touch& touch, MeasuredColumns columns, Digits digits, const Truth* truth,
                      std::optional<double> depth_rms_error_mm, const std::string& source) {
  const bool listed = (columns.groups & Group::Contacts) && counted(touch);
  // The number of contacts gives way to their list.
  Row row(Row::Form::Json, columns.with(Group::Contacts, false), digits);
  add_frame(row, touch, source);
  add_measured(row, touch, row.has(Group::Touching));
  add_truth(row, truth, depth_rms_error_mm);
  std::string line = "{" + row.line();
  if (listed) {
    line += ",\"contacts\":[";
    for (const ContactTouch& contact : touch.contacts) {
      Row one(Row::Form::Json, columns, digits);
      add_contact(one, contact);
      line += (&contact == &touch.contacts.front() ? "{" : ",{") + one.line() + "}";
    }
    line += "]";
  }
  return line + "}";
}

}  // namespace palpate

#include "capture/files/measurements.h"

#include <charconv>
#include <cmath>
#include <string_view>
#include <utility>

#include "capture/files/csv_table.h"
#include "palpate/pipeline.h"

namespace palpate {
namespace {

constexpr const char* kMeasured =
    "contact,gray_sum,force_N,force_sd_N,force_state,centroid_x_px,centroid_y_px,area_px,area_"
    "mm2,"
    "ellipse_major_mm,ellipse_minor_mm,ellipse_angle_rad,peak_gray,saturated_px,shear_x_N,shear_x_sd_N,shear_"
    "y_N,"
    "shear_y_sd_N,shear_state,shift_x_mm,shift_y_mm,slip,depth_max_mm,depth_sd_mm,depth_state,depth_"
    "reference,unknown_px,shadowed_px,outside_px,islands,weighted_residual,weighted_misfit,clipped_px,"
    "contacts,volume_mm3,skin_points,skin_lost,skin_shift_x_mm,skin_shift_x_sd_mm,skin_shift_y_mm,"
    "skin_shift_y_sd_mm,torsion_rad,torsion_sd_rad,stick_share,stick_share_sd,gradient_sum,"
    "light_state,light_change_gray";
constexpr const char* kOfContact =
    "id,frames,gray_sum,force_N,force_sd_N,force_state,centroid_x_px,centroid_y_px,area_px,"
    "area_mm2,ellipse_major_mm,ellipse_minor_mm,ellipse_angle_rad,peak_gray,saturated_px,shear_x_N,"
    "shear_x_sd_N,shear_y_N,shear_y_sd_N,shear_state,shift_x_mm,shift_y_mm,slip,at_border,box_x_px,"
    "box_y_px,box_width_px,box_height_px";
constexpr const char* kTrue =
    ",true_contact,true_force_N,true_shear_x_N,true_shear_y_N,true_slip,true_center_x_px,true_center_y_px,"
    "true_radius_px,true_depth_max_mm,depth_rms_error_mm,true_contacts,true_volume_mm3,true_torsion_rad,"
    "true_stick_share";

/// Builds one line cell by cell.
class Row {
 public:
  void text(const std::string& value) {
    if (!first_) line_ += ',';
    first_ = false;
    line_ += value;
  }
  void empty() { text(""); }
  void whole(uint64_t value) { text(std::to_string(value)); }
  void number(double value) { text(std::isfinite(value) ? shortest(value) : ""); }
  void number_if(bool known, double value) { known ? number(value) : empty(); }
  const std::string& line() const { return line_; }

 private:
  std::string line_;
  bool first_ = true;
};

/// The columns of a sensor without a scale.
std::string in_px(std::string names) {
  for (const auto& [of_scale, without] : {std::pair<std::string_view, std::string_view>{",area_mm2", ""},
                                          {",ellipse_major_mm", ",ellipse_major_px"},
                                          {",ellipse_minor_mm", ",ellipse_minor_px"},
                                          {",shift_x_mm", ",shift_x_px"},
                                          {",shift_y_mm", ",shift_y_px"}})
    names.replace(names.find(of_scale), of_scale.size(), without);
  return names;
}

std::string frame_names(bool source) {
  return source ? "frame,time_s,source," : "frame,time_s,";
}

void add_frame(Row& row, const Touch& touch, bool time) {
  row.whole(touch.sequence);
  row.number_if(time, static_cast<double>(touch.time_ns) / 1e9);
}

// Cells common to a frame's whole touch and one contact, in the columns' order.
template <typename Shape>
void add_shape(Row& row, const Shape& shape, bool contact, bool scaled) {
  row.number(shape.gray_sum);
  row.number_if(has_value(shape.force_N), shape.force_N.value);
  row.number_if(has_value(shape.force_N), shape.force_N.standard_error);
  row.text(to_string(shape.force_N.validity));
  row.number_if(contact, shape.centroid_x_px);
  row.number_if(contact, shape.centroid_y_px);
  row.whole(shape.area_px);
  if (scaled) row.number(shape.area_mm2);
  row.number_if(contact, scaled ? shape.ellipse.major_mm : shape.ellipse.major_px);
  row.number_if(contact, scaled ? shape.ellipse.minor_mm : shape.ellipse.minor_px);
  row.number_if(contact, shape.ellipse.angle_rad);
  row.number(shape.peak_gray);
  row.whole(shape.saturated_px);
  for (const Estimate* shear : {&shape.shear_x_N, &shape.shear_y_N}) {
    row.number_if(has_value(*shear), shear->value);
    row.number_if(has_value(*shear), shear->standard_error);
  }
  row.text(to_string(shape.shear_x_N.validity));
  row.number_if(contact, scaled ? shape.shift_x_mm : shape.shift_x_px);
  row.number_if(contact, scaled ? shape.shift_y_mm : shape.shift_y_px);
  row.text(to_string(shape.slip));
}

void add_contact(Row& row, const Touch& touch, bool scaled) {
  row.whole(touch.contact ? 1 : 0);
  add_shape(row, touch, touch.contact && touch.contacts.size() < 2, scaled);
}

// More regions than there was room for: how many contacts there are is not known.
bool counted(const Touch& touch) {
  return touch.regions && !touch.regions->overflow;
}

void add_skin(Row& row, const Touch& touch) {
  const SkinMotion skin = touch.skin.value_or(SkinMotion{});
  for (const uint32_t points : {skin.points, skin.lost}) touch.skin ? row.whole(points) : row.empty();
  for (const Estimate* one : {&skin.shift_x_mm, &skin.shift_y_mm, &skin.torsion_rad, &skin.stick_fraction}) {
    const bool known = touch.skin && has_value(*one);
    row.number_if(known, one->value);
    row.number_if(known, one->standard_error);
  }
}

void add_truth(Row& row, const Truth* truth, std::optional<double> depth_rms_error_mm) {
  constexpr int kColumns = 14;
  if (!truth) {
    for (int i = 0; i < kColumns; ++i) row.empty();
    return;
  }
  row.whole(truth->contact ? 1 : 0);
  row.number(truth->force_N);
  row.number(truth->shear_x_N);
  row.number(truth->shear_y_N);
  row.whole(truth->slipping ? 1 : 0);
  row.number_if(truth->contact, truth->center_x_px);
  row.number_if(truth->contact, truth->center_y_px);
  row.number(truth->radius_px);
  row.number(truth->indentation_mm);
  row.number_if(depth_rms_error_mm.has_value(), depth_rms_error_mm.value_or(0));
  // A scene with one contact may leave the list to its single fields.
  row.whole(truth->contacts.empty() ? (truth->contact ? 1 : 0) : truth->contacts.size());
  row.number(truth->volume_mm3);
  row.number(truth->torsion_rad);
  row.number_if(truth->contact, truth->stick_fraction);
}

}  // namespace

std::string shortest(double value) {
  char text[40];
  const auto end = std::to_chars(text, text + sizeof text, value).ptr;
  return std::string(text, end);
}

bool has_value(const Estimate& estimate) {
  return estimate.validity != Validity::NotCalibrated && estimate.validity != Validity::NoContact;
}

std::string Measurements::header(bool truth, bool source, bool scaled) {
  return frame_names(source) + cell_names(scaled) + (truth ? kTrue : "");
}

std::string Measurements::cell_names(bool scaled) {
  return scaled ? kMeasured : in_px(kMeasured);
}

Measurements::Measurements(const std::filesystem::path& file, const Columns& columns)
    : file_(file), columns_(columns) {
  file_.append(header(columns.truth, columns.source, columns.scaled));
}

std::string Measurements::cells(const Touch& touch, uint32_t outputs, bool scaled) {
  Row row;
  if (outputs & static_cast<uint32_t>(Output::Force)) {
    add_contact(row, touch, scaled);
  } else {
    constexpr int kContactColumns = 22;
    for (int i = 0; i < kContactColumns - (scaled ? 0 : 1); ++i) row.empty();
  }
  const SurfaceSummary surface = touch.surface.value_or(SurfaceSummary{});
  row.number_if(touch.surface.has_value(), surface.depth_max_mm);
  row.number_if(touch.surface && surface.depth_sd_mm > 0, surface.depth_sd_mm);
  row.text(touch.surface ? to_string(surface.validity) : "");
  row.text(!touch.surface ? "" : surface.rest_from_untouched ? "rest" : "mean");
  const ConfidenceSummary confidence = touch.confidence.value_or(ConfidenceSummary{});
  for (const uint64_t count : {confidence.unknown_px, confidence.shadowed_px, confidence.outside_px})
    touch.confidence ? row.whole(count) : row.empty();
  const WeightedSummary weighted = surface.weighted.value_or(WeightedSummary{});
  surface.weighted ? row.whole(weighted.islands) : row.empty();
  row.number_if(weighted.residual.has_value(), weighted.residual.value_or(0));
  row.number_if(weighted.unexplained.has_value(), weighted.unexplained.value_or(0));
  touch.surface ? row.whole(surface.clipped_px) : row.empty();
  counted(touch) ? row.whole(touch.contacts.size()) : row.empty();
  row.number_if(touch.surface.has_value(), surface.volume_mm3);
  add_skin(row, touch);
  row.number_if(touch.gradient_sum.has_value(), touch.gradient_sum.value_or(0));
  row.text(touch.light ? to_string(touch.light->state) : "");
  row.number_if(touch.light.has_value(), touch.light.value_or(LightSummary{}).change_gray);
  return row.line();
}

void Measurements::add(const Touch& touch, const Truth* truth, std::optional<double> depth_rms_error_mm,
                       const std::string& source) {
  Row row;
  add_frame(row, touch, columns_.time);
  if (columns_.source) row.text(csv_cell(source));
  row.text(cells(touch, columns_.outputs, columns_.scaled));
  if (columns_.truth) add_truth(row, truth, depth_rms_error_mm);
  file_.append(row.line());
}

ContactRows::ContactRows(const std::filesystem::path& file, bool time, bool source, bool scaled)
    : file_(file), time_(time), source_(source), scaled_(scaled) {
  file_.append(header(source, scaled));
}

std::string ContactRows::header(bool source, bool scaled) {
  return frame_names(source) + (scaled ? kOfContact : in_px(kOfContact));
}

void ContactRows::add(const Touch& touch, const std::string& source) {
  for (const ContactTouch& contact : touch.contacts) {
    Row row;
    add_frame(row, touch, time_);
    if (source_) row.text(csv_cell(source));
    row.whole(contact.id);
    row.whole(contact.frames);
    add_shape(row, contact, true, scaled_);
    row.whole(contact.at_border ? 1 : 0);
    for (const uint32_t side : {contact.box.x, contact.box.y, contact.box.width, contact.box.height})
      row.whole(side);
    file_.append(row.line());
  }
}

}  // namespace palpate

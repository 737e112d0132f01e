// The list of quantities: each entry is complete, tables and JSON say the same, the README names them all.
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <map>
#include <set>
#include <sstream>
#include <utility>

#include "capture/files/measurements.h"
#include "capture/files/true_quantities.h"
#include "capture/messages/touch_json.h"
#include "capture/run/process/comparison.h"
#include "engine/base/numbers.h"
#include "palpate/options.h"
#include "tests/support/csv_table.h"
#include "tests/support/json.h"
#include "tests/support/text_file.h"

namespace palpate {
namespace {

using Groups = MeasuredColumns;

constexpr MeasuredColumns kEverything{(Groups::Truth << 1) - 1};

// The header as other programs have read it since the first version: no name may change.
constexpr const char* kHeader =
    "frame,time_s,source,contact,gray_sum,force_N,force_sd_N,force_state,centroid_x_px,centroid_y_px,area_px,"
    "area_mm2,ellipse_major_mm,ellipse_major_px,ellipse_minor_mm,ellipse_minor_px,ellipse_angle_rad,peak_"
    "gray,saturated_px,shear_x_N,shear_x_sd_N,shear_y_N,shear_y_sd_N,shear_state,shift_x_mm,shift_x_px,shift_"
    "y_mm,shift_y_px,slip,slip_by,depth_max_mm,depth_sd_mm,depth_state,depth_reference,unknown_px,shadowed_"
    "px,outside_px,islands,weighted_residual,weighted_misfit,clipped_px,contacts,volume_mm3,dented_mm2,"
    "extrapolated_px,skin_points,skin_lost,skin_shift_x_mm,skin_shift_x_sd_mm,skin_shift_y_mm,skin_shift_y_"
    "sd_mm,torsion_rad,torsion_sd_rad,stick_share,stick_share_sd,gradient_sum,light_state,light_change_gray,"
    "wrench_fx_N,wrench_fx_sd_N,wrench_fy_N,wrench_fy_sd_N,wrench_fz_N,wrench_fz_sd_N,wrench_mx_Nmm,wrench_"
    "mx_sd_Nmm,wrench_my_Nmm,wrench_my_sd_Nmm,wrench_mz_Nmm,wrench_mz_sd_Nmm,wrench_state,pressure_max_kPa,"
    "shear_max_kPa,pressed_area_mm2,unexplained_slope,bending_mm,object_state,object_loss,object_doubt,"
    "object_track,object_surface,object_x_mm,object_y_mm,object_z_mm,object_shift_x_mm,object_shift_x_sd_mm,"
    "object_shift_y_mm,object_shift_y_sd_mm,object_shift_z_mm,object_shift_z_sd_mm,object_turn_x_rad,object_"
    "turn_x_sd_rad,object_turn_y_rad,object_turn_y_sd_rad,object_turn_z_rad,object_turn_z_sd_rad,object_on_"
    "skin,"
    "object_slip_x_mm,object_slip_x_sd_mm,object_slip_y_mm,object_slip_y_sd_mm,object_residual_mm,object_"
    "overlap,true_contact,true_force_N,true_shear_x_N,true_shear_y_N,true_slip,true_"
    "center_x_px,true_center_y_px,true_radius_px,true_depth_max_mm,depth_rms_error_mm,true_contacts,true_"
    "volume_mm3,true_torsion_rad,true_stick_share";
constexpr const char* kContactsHeader =
    "frame,time_s,source,id,frames,gray_sum,force_N,force_sd_N,force_state,centroid_x_px,centroid_y_px,"
    "area_px,area_mm2,ellipse_major_mm,ellipse_major_px,ellipse_minor_mm,ellipse_minor_px,ellipse_angle_rad,"
    "peak_gray,saturated_px,shear_x_N,shear_x_sd_N,shear_y_N,shear_y_sd_N,shear_state,shift_x_mm,shift_x_px,"
    "shift_y_mm,shift_y_px,slip,at_border,box_x_px,box_y_px,box_width_px,box_height_px";
// A frame in which each number is another.
constexpr const char* kRow =
    "7,0.250000,a.png,1,1234.5,0.840,0.012,valid,10.12,20.25,300,3.0000,2.0000,40.00,1.5000,30.00,0.5000,99."
    "00,4,0.1000,0.0000,-0.200,0.020,onset unseen,0.0123,0.25,-0.0123,-0.25,incipient "
    "slip,skin,0.420,0.011,slopes "
    "clipped,rest,5,6,7,2,0.001000,0.020000,8,1,0.7500,4.5000,9,120,3,0.050,0.010,-0.060,0.011,0.0300,0.0020,"
    "0.800,0.040,55.5,changed,1.25,0.10,0.20,0.30,0.40,0.50,0.60,0.70,0.80,0.9,1.0,1.1,1.2,too deep for the "
    "pad,33.00,11.00,6.50,0.0150,7.2500,tracked,none,none,2,revolution,0.5000,-0.2500,0.4000,0.310,0.020,-0."
    "310,0.030,0.110,0.010,0.0210,0.0040,-0.0210,0.0050,,,slips,0.125,0.011,,,0.0021,0.750000,1,0.85,0.1,-0."
    "2,1,10,20,30,0.43,0."
    "005000,1,0.8,0.031,0.79";

Touch distinct_touch() {
  Touch t;
  t.sequence = 7;
  t.time_ns = 250'000'000;
  t.contact = true;
  t.gray_sum = 1234.5;
  t.force_N = {0.84, 0.012, Validity::Valid};
  t.centroid_x_px = 10.123;
  t.centroid_y_px = 20.25;
  t.area_px = 300;
  t.area_mm2 = 3;
  t.ellipse = {2, 1.5, 0.5, 40, 30};
  t.peak_gray = 99;
  t.saturated_px = 4;
  t.shear_x_N = {0.1, 0, Validity::OnsetUnseen};
  t.shear_y_N = {-0.2, 0.02, Validity::OnsetUnseen};
  t.shift_x_mm = 0.0123;
  t.shift_y_mm = -0.0123;
  t.shift_x_px = 0.25;
  t.shift_y_px = -0.25;
  t.slip = Slip::Incipient;
  t.surface.emplace() = {.validity = Validity::Clipped,
                         .depth_max_mm = 0.42,
                         .depth_sd_mm = 0.011,
                         .rest_from_untouched = true,
                         .volume_mm3 = 0.75,
                         .dented_mm2 = 4.5,
                         .clipped_px = 8,
                         .extrapolated_px = 9,
                         .weighted = WeightedSummary{0.001, 0.02, 2, 1}};
  t.confidence = {5, 6, 7};
  t.regions.emplace();
  t.contacts.resize(1);
  t.skin = {120,
            3,
            50,
            {0.05, 0.01, Validity::Valid},
            {-0.06, 0.011, Validity::Valid},
            {0.03, 0.002, Validity::Valid},
            {0.8, 0.04, Validity::Valid}};
  t.gradient_sum = 55.5;
  t.light = {LightState::Changed, 1.25};
  TractionSummary& w = t.traction.emplace();
  double next = 0.1;
  for (Estimate* one : {&w.fx_N, &w.fy_N, &w.fz_N, &w.mx_Nmm, &w.my_Nmm, &w.mz_Nmm}) {
    *one = {next, next + 0.1, Validity::TooDeep};
    next += 0.2;
  }
  w.pressure_max_kPa = 33;
  w.shear_max_kPa = 11;
  w.area_mm2 = 6.5;
  w.slipping_fraction = 0.25;
  w.unexplained_slope = 0.015;
  w.bending_mm = 7.25;
  ObjectPose& object = t.object.emplace();
  object.state = PoseState::Tracked;
  object.track = 2;
  object.surface = Slippage::Revolution;
  object.at_mm = {0.5, -0.25, 0.4};
  object.shift_mm = {
      {{0.31, 0.02, Validity::Valid}, {-0.31, 0.03, Validity::Valid}, {0.11, 0.01, Validity::Valid}}};
  object.turn_rad = {{{0.021, 0.004, Validity::Valid},
                      {-0.021, 0.005, Validity::Valid},
                      {kNaN, kNaN, Validity::Undetermined}}};
  object.on_skin = OnSkin::Slips;
  object.slip_mm = {{{0.125, 0.011, Validity::Valid}, {kNaN, kNaN, Validity::Undetermined}}};
  object.residual_mm = 0.0021;
  object.overlap = 0.75;
  return t;
}

Truth distinct_truth() {
  return {.sequence = 7,
          .time_s = 0.25,
          .contact = true,
          .force_N = 0.85,
          .shear_x_N = 0.1,
          .shear_y_N = -0.2,
          .slipping = true,
          .center_x_px = 10,
          .center_y_px = 20,
          .radius_px = 30,
          .indentation_mm = 0.43,
          .stick_share = 0.79,
          .torsion_rad = 0.031,
          .volume_mm3 = 0.8,
          .contacts = {},
          .depth_mm = {}};
}

TEST(Quantities, NamesAndBytesOfTheTablesStay) {
  EXPECT_EQ(Measurements::header(kEverything), kHeader);
  EXPECT_EQ(ContactRows::header(kEverything), kContactsHeader);
  const Truth truth = distinct_truth();
  EXPECT_EQ(Measurements::row(distinct_touch(), kEverything, Digits::Deserved, &truth, 0.005, "a.png"), kRow);
}

/// What each entry has to have, whatever it is of.
template <typename Of>
void expect_complete(std::span<const MeasuredQuantity<Of>> quantities, bool rows) {
  std::set<std::string> names;
  for (const MeasuredQuantity<Of>& q : quantities) {
    SCOPED_TRACE(q.name);
    EXPECT_TRUE(names.insert(q.name).second);
    const std::string sentence = q.sentence, unit = q.unit;
    EXPECT_GT(sentence.size(), 10u);
    EXPECT_TRUE(sentence.ends_with(".")) << sentence;
    EXPECT_NE(q.value, nullptr);
    std::string suffix = "_" + unit;
    std::erase(suffix, ' ');
    if (!unit.empty() && !unit.starts_with("gray")) {
      EXPECT_TRUE(std::string(q.name).ends_with(suffix)) << unit;
    }
    const bool column = q.group != 0, attribute = !python_name(q).empty(), row = !rows || *q.row.label;
    const bool reason = *q.why != 0;
    EXPECT_TRUE(reason || (column && attribute && row)) << "why is it not everywhere?";
    EXPECT_FALSE(rows && reason && column && attribute && row) << "a reason for nothing: " << q.why;
    EXPECT_TRUE(q.kind == QuantityKind::Estimated || !q.state) << "a state is an estimate's";
  }
}

TEST(Quantities, EachIsComplete) {
  expect_complete(frame_quantities(), true);
  expect_complete(touch_quantities(), true);
  expect_complete(contact_quantities(), false);
  expect_complete(true_quantities(), false);
  EXPECT_GT(touch_quantities().size(), 50u);
  // A quantity has a value of its kind, or none.
  const Touch touch = distinct_touch();
  for (const MeasuredQuantity<Touch>& q : touch_quantities()) {
    const size_t kinds[] = {1, 2, 3, 4, 5};  // of QuantityValue, in the order of QuantityKind
    EXPECT_EQ(q.value(touch).index(), kinds[static_cast<size_t>(q.kind)]) << q.name;
    const size_t bare = q.value(Touch{}).index();
    EXPECT_TRUE(bare == 0 || bare == kinds[static_cast<size_t>(q.kind)]) << q.name;
  }
}

TEST(Quantities, JsonHasTheCellsOfTheTable) {
  Touch touch = distinct_touch();
  const Truth truth = distinct_truth();
  for (const Validity state : {Validity::Valid, Validity::NoContact, Validity::PictureDamaged}) {
    touch.force_N.validity = touch.skin->torsion_rad.validity = state;
    touch.contact = state != Validity::NoContact;
    const Table table(Measurements::header(kEverything) + "\n" +
                      Measurements::row(touch, kEverything, Digits::All, &truth, 0.005, "a.png"));
    const Json line = parse_json(json_line(touch, kEverything, Digits::All, &truth, 0.005, "a.png"));
    size_t cells = 0;
    for (const std::string& column : table.columns) {
      const std::string& cell = table.at(0, column);
      if (column == "contacts") {
        EXPECT_EQ(std::to_string(line[column].size()), cell);
      } else if (cell.empty()) {
        EXPECT_FALSE(line.contains(column)) << column;
      } else if (line.at(column).is_string()) {
        EXPECT_EQ(line[column], cell) << column;
      } else {
        EXPECT_EQ(line[column].get<double>(), std::stod(cell)) << column;
      }
      cells += !cell.empty();
    }
    EXPECT_EQ(line.size(), cells);
  }
}

/// The output that fills a group; empty: force or surface, by the sensor.
std::string output_of(uint32_t group) {
  switch (group) {
    case Groups::Confidence:
    case Groups::Weighted:
      return "confidence";
    case Groups::Contacts:
    case Groups::Dented:
    case Groups::Extrapolated:
      return "contacts";
    case Groups::Skin:
      return "skin";
    case Groups::Gradient:
      return "gradient";
    case Groups::Traction:
      return "traction";
    case Groups::Object:
      return "motion";
    default:
      return "";
  }
}

template <typename Of>
std::string table_rows(std::span<const MeasuredQuantity<Of>> quantities) {
  std::string rows;
  const auto code = [](std::string_view name) { return "`" + std::string(name) + "`"; };
  for (const MeasuredQuantity<Of>& q : quantities) {
    std::string columns = q.group ? code(q.name) : "-";
    if (q.group && q.kind == QuantityKind::Estimated) columns += ", " + code(error_name(q));
    if (q.state) columns += ", " + code(q.state);
    const std::string attribute(python_name(q)), output = output_of(q.group);
    rows += "| " + columns + " | " + (attribute.empty() ? "-" : code(attribute)) + " | " + q.unit + " | " +
            output + " | " + q.sentence + " |\n";
  }
  return rows;
}

std::string readme_table() {
  const std::string head = "| column | attribute | unit | output | meaning |\n|---|---|---|---|---|\n";
  return head + table_rows(frame_quantities()) + table_rows(touch_quantities()) +
         table_rows(true_quantities());
}

// PALPATE_WRITE_TABLES=1 writes it anew.
/// The text of a cell in a touch as JSON; "" where there is no value.
std::string cell_of(const Json& field, const char* key) {
  const Json& value = field.at(key);
  if (value.is_null()) return "";
  if (value.is_boolean()) return value.get<bool>() ? "1" : "0";
  if (value.is_string()) return value.get<std::string>();
  return value.is_number_float() ? shortest(value.get<double>()) : value.dump();
}

TEST(Quantities, ATouchAsJsonHasTheCellsOfTheTable) {
  constexpr MeasuredColumns kMeasured{Groups::Truth - 1};
  Touch touch = distinct_touch();
  const Json schema = parse_json(touch_json_schema(kMeasured)).at("properties");
  for (const Validity state : {Validity::Valid, Validity::NoContact, Validity::PictureDamaged}) {
    touch.force_N.validity = touch.skin->torsion_rad.validity = state;
    touch.contact = state != Validity::NoContact;
    const Table table(Measurements::header(kMeasured) + "\n" +
                      Measurements::row(touch, kMeasured, Digits::All));
    const Json parsed = parse_json(touch_json(touch, kMeasured, 1'700'000'000'000'000'005));
    EXPECT_EQ(parsed["frame"], touch.sequence);
    EXPECT_EQ(parsed["stamp"]["nanosec"], 5);
    for (const auto& q : touch_quantities()) {
      if (q.group == 0 || q.group == Groups::Contacts) continue;
      const Json& field = parsed.at(q.name);
      for (const auto& [key, value] : field.items())
        EXPECT_TRUE(schema[q.name]["properties"].contains(key)) << q.name << ' ' << key;
      if (*q.unit) {
        EXPECT_EQ(field.at("unit"), q.unit);
      }
      EXPECT_EQ(cell_of(field, "value"), table.at(0, q.name)) << q.name;
      if (q.kind != QuantityKind::Estimated) continue;
      EXPECT_EQ(cell_of(field, "standard_error"), table.at(0, error_name(q))) << q.name;
      if (q.state) {
        EXPECT_EQ(cell_of(field, "state"), table.at(0, q.state)) << q.name;
      }
    }
    EXPECT_EQ(parsed.at("contacts").size(), touch.contacts.size());
    EXPECT_EQ(parsed["contacts"][0].at("id").at("value"), touch.contacts[0].id);
  }
  EXPECT_FALSE(contains(touch_json(touch, kMeasured, 0), "zeroed"));
  EXPECT_TRUE(contains(touch_json(touch, kMeasured, 0, true), "\"zeroed\":true"));
}

TEST(Quantities, SlipSaysWhatShowsIt) {
  const auto all = touch_quantities();
  const auto by = std::ranges::find(all, std::string_view("slip_by"), &MeasuredQuantity<Touch>::name);
  ASSERT_NE(by, all.end());
  const auto word = [&](const Touch& touch) {
    const QuantityValue value = by->value(touch);
    const auto* const found = std::get_if<std::string_view>(&value);
    return found ? *found : std::string_view();
  };
  Touch touch = distinct_touch();
  for (const Slip slip : {Slip::Stick, Slip::Incipient, Slip::Slip}) {
    touch.slip = slip;
    EXPECT_EQ(word(touch), "skin");
    Touch bare = touch;
    bare.skin.reset();
    EXPECT_EQ(word(bare), "limit");
  }
  for (const Slip slip : {Slip::NoContact, Slip::NotCalibrated, Slip::PictureDamaged}) {
    touch.slip = slip;
    EXPECT_EQ(word(touch), "");
  }
  ASSERT_TRUE(by->in_table(touch));
  touch.contacts.resize(2);
  EXPECT_FALSE(by->in_table(touch));
}

TEST(Quantities, TheTableInTheReadmeIsTheList) {
  const std::string file = std::string(PALPATE_SOURCE_DIR) + "/capture/files/README.md";
  const std::string text = slurp(file), begin = "<!-- quantities -->\n", end = "<!-- end -->\n";
  const size_t from = text.find(begin), to = text.find(end);
  ASSERT_LT(from, to) << file;
  const std::string found = text.substr(from + begin.size(), to - from - begin.size());
  if (std::getenv("PALPATE_WRITE_TABLES")) {
    std::ofstream(file) << text.substr(0, from + begin.size()) + readme_table() + text.substr(to);
    return;
  }
  std::istringstream wanted(readme_table()), there(found);
  for (std::string a, b; std::getline(wanted, a);) {
    ASSERT_TRUE(std::getline(there, b)) << "no row '" << a << "': PALPATE_WRITE_TABLES=1 writes the table";
    EXPECT_EQ(b, a) << "PALPATE_WRITE_TABLES=1 writes the table";
  }
  EXPECT_EQ(found, readme_table());
}

TEST(Quantities, EstimatesAreComparedWithTheirTruth) {
  Comparison comparison;
  Touch touch = distinct_touch();
  comparison.add(touch, distinct_truth(), 0.005);  // its depth is a lower bound
  touch.force_N.validity = Validity::Saturated;
  touch.surface->validity = Validity::Valid;
  touch.skin->stick_share.validity = Validity::BelowRange;
  comparison.add(touch, distinct_truth(), 0.005);
  const std::map<std::string, std::pair<uint64_t, double>> expected = {
      {"force_N", {1, -0.01}},
      {"shear_x_N", {2, 0}},
      {"shear_y_N", {2, 0}},
      {"depth_max_mm", {1, -0.01}},
      {"torsion_rad", {2, -0.001}},
      {"stick_share", {1, 0.01}},
      {"center_px", {2, std::hypot(0.123, 0.25)}},
      {"depth_map_rms_mm", {1, 0.005}}};
  EXPECT_EQ(comparison.compared().size(), expected.size());
  for (const auto& [name, words, errors] : comparison.compared()) {
    ASSERT_TRUE(expected.contains(name)) << name;
    EXPECT_EQ(errors.count(), expected.at(name).first) << name;
    EXPECT_NEAR(errors.mean(), expected.at(name).second, 1e-12) << name;
  }
  EXPECT_EQ(comparison.counts().flagged, 1u);
  EXPECT_EQ(comparison.counts().depth_flagged, 1u);
  Touch missed;
  comparison.add(missed, distinct_truth(), std::nullopt);
  EXPECT_EQ(comparison.counts().contact_missed, 1u);
  EXPECT_EQ(comparison.counts().largest_missed_N, 0.85);
}

TEST(Quantities, NamesOfErrorsAndWords) {
  EXPECT_EQ(error_name("force_N", "N"), "force_sd_N");
  EXPECT_EQ(error_name("wrench_mx_Nmm", "N mm"), "wrench_mx_sd_Nmm");
  EXPECT_EQ(error_name("stick_share", ""), "stick_share_sd");
  EXPECT_EQ(words_of("shear_x_N", "N"), "shear x, N");
  EXPECT_EQ(words_of("stick_share", ""), "stick share");
}

}  // namespace
}  // namespace palpate

#include "capture/files/measurements.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <span>

#include "capture/files/tables/csv_table.h"
#include "capture/files/true_quantities.h"
#include "engine/base/json.h"
#include "palpate/options.h"

namespace palpate {
namespace {

/// The columns of a quantity: its own, its error's, its state's; names empty where there is none.
struct ColumnNames {
  std::string value, error, state;
};
template <typename Of>
ColumnNames columns_of(const MeasuredQuantity<Of>& q) {
  return {q.name, q.kind == QuantityKind::Estimated ? error_name(q) : "", q.state ? q.state : ""};
}
template <typename Of>
uint32_t error_group(const MeasuredQuantity<Of>& q) {
  return q.error_group ? q.error_group : q.group;
}

template <typename Of>
void add_names(std::string& line, std::span<const MeasuredQuantity<Of>> quantities, uint32_t groups) {
  for (const MeasuredQuantity<Of>& q : quantities) {
    const ColumnNames columns = columns_of(q);
    const auto add = [&](const std::string& name, uint32_t group) {
      if (!name.empty() && (groups & group)) line += (line.empty() ? "" : ",") + name;
    };
    add(columns.value, q.group);
    add(columns.error, error_group(q));
    add(columns.state, q.group);
  }
}

/// Builds a row cell by cell, in the columns' order; cells of columns that are not there are dropped.
class MeasurementRow {
 public:
  enum class Form : uint8_t { CsvLine, JsonObject };
  MeasurementRow(Form form, MeasuredColumns columns, Digits digits)
      : form_(form), columns_(columns), digits_(digits) {}

  /// The cells of `of`; of groups that are not `measured` they stay empty. `of` null: all do.
  template <typename Of>
  void add(std::span<const MeasuredQuantity<Of>> quantities, const Of* of, uint32_t measured = ~0u) {
    for (const MeasuredQuantity<Of>& q : quantities) {
      if (!(columns_.groups & (q.group | error_group(q)))) continue;
      QuantityValue value;
      if (of && (measured & q.group) && (!q.in_table || q.in_table(*of))) value = q.value(*of);
      add_cells(q, value);
    }
  }
  const std::string& line() const { return line_; }

 private:
  template <typename Of>
  void add_cells(const MeasuredQuantity<Of>& q, const QuantityValue& value) {
    if (q.kind != QuantityKind::Estimated) return put(q.name, q.group, cell_of(value, q.places));
    const Estimate* shown = shown_estimate(q, value);
    const double error = shown ? shown->standard_error : 0;
    const int places = error > 0 && std::isfinite(error) ? deserved_places(error) : q.places;
    put(q.name, q.group, shown ? number(shown->value, places) : "");
    const bool json = form_ == Form::JsonObject;  // the only form that names its cells
    put(json ? error_name(q) : "", error_group(q), shown ? number(error, places) : "");
    if (!q.state) return;
    const Estimate* estimate = std::get_if<Estimate>(&value);
    put(q.state, q.group, estimate ? word(to_string(estimate->validity)) : "");
  }

  std::string cell_of(const QuantityValue& value, int places) const {
    if (const bool* flag = std::get_if<bool>(&value)) return *flag ? "1" : "0";
    if (const uint64_t* count = std::get_if<uint64_t>(&value)) return std::to_string(*count);
    if (const double* found = std::get_if<double>(&value)) return number(*found, places);
    if (const auto* text = std::get_if<std::string_view>(&value)) return word(*text);
    return "";
  }
  std::string number(double value, int places) const {
    if (!std::isfinite(value)) return "";
    return digits_ == Digits::All || places == kAllPlaces ? shortest(value) : with_places(value, places);
  }
  std::string word(std::string_view text) const {
    return form_ == Form::CsvLine ? csv_cell(std::string(text))
                                  : json::Value(std::string(text)).dump(-1, json::Utf8::Replace);
  }

  void put(const std::string& name, uint32_t group, const std::string& cell) {
    if (!(columns_.groups & group)) return;
    if (form_ == Form::JsonObject) {
      if (!cell.empty()) line_ += (line_.empty() ? "\"" : ",\"") + name + "\":" + cell;
      return;
    }
    if (!first_) line_ += ',';
    first_ = false;
    line_ += cell;
  }

  Form form_;
  MeasuredColumns columns_;
  Digits digits_;
  std::string line_;
  bool first_ = true;
};

FrameKey key_of(const Touch& touch, const std::string& source) {
  return {touch.sequence, touch.time_ns, source};
}

void add_frame_row(MeasurementRow& row, const Touch& touch, const Truth* truth,
                   std::optional<double> depth_rms_error_mm, const std::string& source) {
  const FrameKey key = key_of(touch, source);
  row.add(frame_quantities(), &key);
  row.add(touch_quantities(), &touch);
  const TrueFrame known{truth, depth_rms_error_mm};
  row.add(true_quantities(), truth ? &known : nullptr);
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

std::string Measurements::header(MeasuredColumns columns) {
  std::string line;
  add_names(line, frame_quantities(), columns.groups);
  add_names(line, touch_quantities(), columns.groups);
  add_names(line, true_quantities(), columns.groups);
  return line;
}

std::string Measurements::cell_names() {
  std::string line;
  add_names(line, touch_quantities(), MeasuredColumns::kAll);
  return line;
}

Measurements::Measurements(const std::filesystem::path& file, MeasuredColumns columns, Digits digits)
    : file_(file), columns_(columns), digits_(digits) {
  file_.append(header(columns));
}

std::string Measurements::cells(const Touch& touch, Outputs outputs) {
  MeasurementRow row(MeasurementRow::Form::CsvLine, {}, Digits::All);
  row.add(touch_quantities(), &touch, wants(outputs, Output::Force) ? ~0u : ~MeasuredColumns::kOfTouch);
  return row.line();
}

std::string Measurements::row(const Touch& touch, MeasuredColumns columns, Digits digits, const Truth* truth,
                              std::optional<double> depth_rms_error_mm, const std::string& source) {
  MeasurementRow row(MeasurementRow::Form::CsvLine, columns, digits);
  add_frame_row(row, touch, truth, depth_rms_error_mm, source);
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
  add_names(line, frame_quantities(), columns.groups);
  add_names(line, contact_quantities(), columns.groups);
  return line;
}

void ContactRows::add(const Touch& touch, const std::string& source) {
  const FrameKey key = key_of(touch, source);
  for (const ContactTouch& contact : touch.contacts) {
    MeasurementRow row(MeasurementRow::Form::CsvLine, columns_, digits_);
    row.add(frame_quantities(), &key);
    row.add(contact_quantities(), &contact);
    file_.append(row.line());
  }
}

std::string json_line(const Touch& touch, MeasuredColumns columns, Digits digits, const Truth* truth,
                      std::optional<double> depth_rms_error_mm, const std::string& source) {
  const bool listed =
      (columns.groups & MeasuredColumns::Contacts) && touch.regions && !touch.regions->overflow;
  // The number of contacts gives way to their list.
  MeasurementRow row(MeasurementRow::Form::JsonObject, columns.with(MeasuredColumns::Contacts, false),
                     digits);
  add_frame_row(row, touch, truth, depth_rms_error_mm, source);
  std::string line = "{" + row.line();
  if (listed) {
    line += ",\"contacts\":[";
    for (const ContactTouch& contact : touch.contacts) {
      MeasurementRow one(MeasurementRow::Form::JsonObject, columns, digits);
      one.add(contact_quantities(), &contact);
      line += (&contact == &touch.contacts.front() ? "{" : ",{") + one.line() + "}";
    }
    line += "]";
  }
  return line + "}";
}

std::string grip_header() {
  std::string line;
  add_names(line, grip_quantities(), MeasuredColumns::kAll);
  return line;
}

std::string grip_row(const GripFrame& frame, Digits digits) {
  MeasurementRow row(MeasurementRow::Form::CsvLine, {}, digits);
  row.add(grip_quantities(), &frame);
  return row.line();
}

std::string grip_json_line(const GripFrame& frame, Digits digits) {
  MeasurementRow row(MeasurementRow::Form::JsonObject, {}, digits);
  row.add(grip_quantities(), &frame);
  return "{" + row.line() + "}";
}

}  // namespace palpate

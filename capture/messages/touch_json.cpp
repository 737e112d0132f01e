#include "capture/messages/touch_json.h"

#include <cmath>

#include "capture/files/measurements.h"
#include "engine/base/json.h"
#include "engine/measure/quantities.h"

namespace palpate {
namespace {

using Json = json::Value;

std::string text_json(std::string_view text) {
  return Json(text).dump(-1, json::Utf8::Replace);
}

std::string number_json(double value) {
  return std::isfinite(value) ? shortest(value) : "null";
}

std::string stamp_json(int64_t stamp_ns) {
  return "{\"sec\":" + std::to_string(stamp_ns / 1'000'000'000) +
         ",\"nanosec\":" + std::to_string(stamp_ns % 1'000'000'000) + "}";
}

template <typename Of>
std::string value_json(const MeasuredQuantity<Of>& q, const QuantityValue& value) {
  if (q.kind == QuantityKind::Estimated) {
    const Estimate* shown = shown_estimate(q, value);
    return shown ? number_json(shown->value) : "null";
  }
  if (const bool* flag = std::get_if<bool>(&value)) return *flag ? "true" : "false";
  if (const uint64_t* count = std::get_if<uint64_t>(&value)) return std::to_string(*count);
  if (const double* found = std::get_if<double>(&value)) return number_json(*found);
  if (const auto* text = std::get_if<std::string_view>(&value)) return text_json(*text);
  return "null";
}

template <typename Of>
void add_quantities(std::string& line, std::span<const MeasuredQuantity<Of>> quantities, const Of& of,
                    MeasuredColumns columns) {
  for (const MeasuredQuantity<Of>& q : quantities) {
    if (!(columns.groups & q.group)) continue;
    QuantityValue value;
    if (!q.in_table || q.in_table(of)) value = q.value(of);
    line += (line.back() == '{' ? "" : ",") + text_json(q.name) + ":{\"value\":" + value_json(q, value);
    if (q.unit && *q.unit) line += ",\"unit\":" + text_json(q.unit);
    if (q.kind == QuantityKind::Estimated) {
      const Estimate* shown = shown_estimate(q, value);
      const Estimate* estimate = std::get_if<Estimate>(&value);
      line += ",\"standard_error\":" + (shown ? number_json(shown->standard_error) : std::string("null"));
      if (estimate) line += ",\"state\":" + text_json(to_string(estimate->validity));
    }
    line += '}';
  }
}

const char* json_type(QuantityKind kind) {
  switch (kind) {
    case QuantityKind::Flag:
      return "boolean";
    case QuantityKind::Whole:
      return "integer";
    case QuantityKind::Number:
    case QuantityKind::Estimated:
      return "number";
    case QuantityKind::Word:
      return "string";
  }
  return "number";
}

template <typename Of>
Json properties(std::span<const MeasuredQuantity<Of>> quantities, MeasuredColumns columns) {
  Json all = Json::object();
  for (const MeasuredQuantity<Of>& q : quantities) {
    if (!(columns.groups & q.group)) continue;
    Json of = Json::object();
    of["value"] = Json{{"type", json_type(q.kind)}};
    if (q.unit && *q.unit) of["unit"] = Json{{"type", "string"}, {"const", q.unit}};
    if (q.kind == QuantityKind::Estimated) {
      of["standard_error"] = Json{{"type", "number"}};
      of["state"] = Json{{"type", "string"}};
    }
    all[q.name] = Json{{"type", "object"}, {"description", q.sentence}, {"properties", of}};
  }
  return all;
}

Json stamp_property() {
  return {{"type", "object"},
          {"description", "Time of exposure on the clock of the date"},
          {"properties", {{"sec", {{"type", "integer"}}}, {"nanosec", {{"type", "integer"}}}}}};
}

Json frame_properties() {
  return {{"frame", {{"type", "integer"}, {"description", "Number of the frame"}}},
          {"time_s", {{"type", "number"}, {"description", "Time of exposure since the source began, s"}}},
          {"stamp", stamp_property()}};
}

std::string frame_json(uint64_t frame, double time_s, int64_t stamp_ns) {
  return "{\"frame\":" + std::to_string(frame) + ",\"time_s\":" + number_json(time_s) +
         ",\"stamp\":" + stamp_json(stamp_ns);
}

std::string schema_text(const char* title, const Json& properties) {
  return Json{{"$schema", "https://json-schema.org/draft/2020-12/schema"},
              {"title", title},
              {"type", "object"},
              {"properties", properties}}
      .dump(-1, json::Utf8::Replace);
}

}  // namespace

std::string touch_json(const Touch& touch, MeasuredColumns columns, int64_t stamp_ns, bool zeroed,
                       std::string_view source) {
  std::string line = frame_json(touch.sequence, static_cast<double>(touch.time_ns) / 1e9, stamp_ns);
  if (!source.empty()) line += ",\"source\":" + text_json(source);
  if (zeroed) line += ",\"zeroed\":true";
  add_quantities(line, touch_quantities(), touch, columns.with(MeasuredColumns::Contacts, false));
  const bool listed =
      (columns.groups & MeasuredColumns::Contacts) && touch.regions && !touch.regions->overflow;
  if (listed) {
    line += ",\"contacts\":[";
    for (const ContactTouch& contact : touch.contacts) {
      line += &contact == &touch.contacts.front() ? "{" : ",{";
      add_quantities(line, contact_quantities(), contact, columns);
      line += '}';
    }
    line += ']';
  }
  return line + "}";
}

std::string touch_json_schema(MeasuredColumns columns) {
  Json all = frame_properties();
  all["source"] = Json{{"type", "string"}, {"description", "File of the frame"}};
  all["zeroed"] = Json{{"type", "boolean"}};
  all.update(properties(touch_quantities(), columns.with(MeasuredColumns::Contacts, false)));
  if (columns.groups & MeasuredColumns::Contacts)
    all["contacts"] =
        Json{{"type", "array"},
             {"items", {{"type", "object"}, {"properties", properties(contact_quantities(), columns)}}}};
  return schema_text("palpate.Touch", all);
}

std::string grip_json(const GripFrame& frame, int64_t stamp_ns, bool zeroed) {
  std::string line = "{";
  add_quantities(line, grip_quantities(), frame, {});
  return line + ",\"stamp\":" + stamp_json(stamp_ns) + (zeroed ? ",\"zeroed\":true}" : "}");
}

std::string grip_json_schema() {
  Json all = properties(grip_quantities(), {});
  all["stamp"] = stamp_property();
  all["zeroed"] = Json{{"type", "boolean"}};
  return schema_text("palpate.Grip", all);
}

std::string event_json(const EventMessage& event, int64_t stamp_ns) {
  return frame_json(event.frame, event.time_s, stamp_ns) + ",\"event\":" + text_json(event.kind) +
         ",\"text\":" + text_json(event.text) + "}";
}

std::string event_json_schema() {
  Json all = frame_properties();
  all["event"] = Json{{"type", "string"}};
  all["text"] = Json{{"type", "string"}};
  return schema_text("palpate.Event", all);
}

}  // namespace palpate

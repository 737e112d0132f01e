#include "engine/sensor/json.h"

#include <sstream>

#include "palpate/error.h"

namespace palpate::sensor_json {

void fail(const std::string& where, const std::string& wanted, const std::string& found,
          const std::string& remedy) {
  throw Error(Failure::Sensor, where + ": " + wanted, found, remedy);
}

std::string shown(const Json& value) {
  for (const Json& part : value) {
    if (value.is_structured() && part.is_structured())
      return (value.is_array() ? "a list of " : "an object of ") + std::to_string(value.size());
  }
  std::string text = value.dump(-1, json::Utf8::Ascii);
  return text.size() > 60 ? text.substr(0, 57) + "..." : text;
}

std::string number_text(double value) {
  std::ostringstream out;
  out << value;
  return out.str();
}

void add_origin(Json& json, const Origin& origin) {
  if (origin.empty()) return;
  json["origin"] = {{"from", origin.from}, {"made", origin.made}, {"note", origin.note}};
}

Origin read_origin(Reader& reader) {
  Origin origin;
  if (!reader.has("origin")) return origin;
  Reader section(reader.at("origin"), reader.path("origin"));
  if (section.has("from")) origin.from = section.text("from");
  if (section.has("made")) origin.made = section.text("made");
  if (section.has("note")) origin.note = section.text("note");
  section.finish();
  return origin;
}

}  // namespace palpate::sensor_json

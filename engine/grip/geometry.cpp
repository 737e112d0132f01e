#include "engine/grip/geometry.h"

#include <cmath>
#include <fstream>
#include <iterator>

#include "palpate/error.h"

namespace palpate {
namespace {

constexpr double kRotationTolerance = 1e-3;
constexpr const char* kSides[] = {"left", "right"};

Vector3 cross(const Vector3& a, const Vector3& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

[[noreturn]] void refuse(const std::filesystem::path& where, const std::string& wanted,
                         const std::string& found, const std::string& remedy) {
  throw Error(Failure::Input, wanted + " in '" + where.string() + "'", found, remedy);
}

bool proper(const std::array<Vector3, 3>& rows) {
  for (size_t i = 0; i < 3; ++i)
    for (size_t k = 0; k < 3; ++k)
      if (!(std::abs(scalar_product(rows[i], rows[k]) - (i == k)) <= kRotationTolerance)) return false;
  return scalar_product(cross(rows[0], rows[1]), rows[2]) > 0;
}

PadPose pad_from(const json::Value& pad, const char* side, const std::filesystem::path& where) {
  PadPose pose;
  pose.rotation = pad.at("rotation").get<std::array<Vector3, 3>>();
  if (const json::Value* translation = pad.find("translation_mm"))
    pose.translation_mm = translation->get<Vector3>();
  if (!proper(pose.rotation))
    refuse(where, "a rotation of the " + std::string(side) + " pad", "rows that are not those of a rotation",
           "three rows of length 1, square to each other, right-handed");
  return pose;
}

/// z into the pad looks away from the object.
void check_facing(const GripGeometry& geometry, const std::filesystem::path& where) {
  for (size_t i = 0; i < 2; ++i) {
    const auto& r = geometry.pads[i].rotation;
    const double along = scalar_product({r[0][2], r[1][2], r[2][2]}, geometry.closing);
    if (i == 0 ? along < 0 : along > 0) continue;
    refuse(where, "pads that face each other along \"closing\"",
           "a " + std::string(kSides[i]) + " pad that looks away",
           "its third column, z into the pad, " + std::string(i == 0 ? "against" : "along") +
               " the way of the left pad when the gripper closes");
  }
}

OpeningSource opening_from(const json::Value& value, const std::filesystem::path& where) {
  OpeningSource opening;
  if (const json::Value* fixed = value.find("mm")) opening.fixed_mm = fixed->number();
  if (const json::Value* log = value.find("log")) {
    opening.log = log->text();
    if (opening.log.is_relative()) opening.log = where.parent_path() / opening.log;
  }
  if (const json::Value* column = value.find("column")) opening.column = column->text();
  if (const json::Value* sd = value.find("sd_mm")) opening.sd_mm = sd->number();
  if (!(opening.sd_mm >= 0)) refuse(where, "an \"sd_mm\" of at least 0", "less", "\"sd_mm\": 0.1");
  if (opening.fixed_mm.has_value() == opening.log.empty()) return opening;
  refuse(where, "one opening", opening.fixed_mm ? "\"mm\" and \"log\"" : "neither \"mm\" nor \"log\"",
         "\"opening\": {\"mm\": 30}, or none");
}

}  // namespace

GripFile grip_from_text(const std::string& text, const std::filesystem::path& where) {
  GripFile grip;
  try {
    const json::Value value = json::parse(text, {.comments = true});
    GripGeometry& geometry = grip.geometry;
    for (size_t i = 0; i < 2; ++i) geometry.pads[i] = pad_from(value.at(kSides[i]), kSides[i], where);
    if (const json::Value* closing = value.find("closing")) geometry.closing = closing->get<Vector3>();
    const double length = std::sqrt(scalar_product(geometry.closing, geometry.closing));
    if (!(length > 0 && std::isfinite(length)))
      refuse(where, "a \"closing\" direction", "none", "\"closing\": [1, 0, 0]");
    for (double& part : geometry.closing) part /= length;
    check_facing(geometry, where);
    if (const json::Value* opening = value.find("opening")) grip.opening = opening_from(*opening, where);
  } catch (const json::Error& error) {
    refuse(where, "poses of two pads", error.what(),
           "\"left\" and \"right\", each with \"rotation\" and \"translation_mm\"");
  }
  return grip;
}

GripFile load_grip(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  const std::string text{std::istreambuf_iterator<char>(in), {}};
  if (!in)
    throw Error(Failure::Input, "a grip file", "'" + file.string() + "', which cannot be read", "another");
  return grip_from_text(text, file);
}

json::Value to_json(const GripFile& grip) {
  json::Value value = json::Value::object();
  value["closing"] = grip.geometry.closing;
  for (size_t i = 0; i < 2; ++i) {
    const PadPose& pad = grip.geometry.pads[i];
    value[kSides[i]] = {{"rotation", pad.rotation}, {"translation_mm", pad.translation_mm}};
  }
  const OpeningSource& opening = grip.opening;
  if (opening.fixed_mm) value["opening"] = {{"mm", *opening.fixed_mm}, {"sd_mm", opening.sd_mm}};
  if (!opening.log.empty())
    value["opening"] = {{"log", opening.log.string()}, {"column", opening.column}, {"sd_mm", opening.sd_mm}};
  return value;
}

}  // namespace palpate

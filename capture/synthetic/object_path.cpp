#include "capture/synthetic/object_path.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "capture/files/tables/csv_table.h"
#include "palpate/error.h"

namespace palpate {
namespace {

constexpr double kPi = std::numbers::pi, kDegree = kPi / 180;
constexpr double kWait_s = 0.3, kPress_s = 0.7, kLift_s = 0.6, kRest_s = 0.2;
constexpr double kApproach_mm = 0.3;  // of the highest point, before and after

double smooth_step(double u) {
  u = std::clamp(u, 0.0, 1.0);
  return u * u * (3 - 2 * u);
}

/// Steady pulls to `reach` and back whose highest speed is `speed`, with half a second of rest between.
double dragged_mm(double time_s, double reach_mm, double speed_mm_s) {
  if (speed_mm_s <= 0) return 0;
  const double leg_s = 1.5 * reach_mm / speed_mm_s, round_s = 2 * leg_s + 1, at = std::fmod(time_s, round_s);
  return reach_mm *
         (at < leg_s + 0.5 ? smooth_step(at / leg_s) : 1 - smooth_step((at - leg_s - 0.5) / leg_s));
}

/// A trembling of 8 to 12 Hz, whose largest value is about `size`.
double tremor(double time_s, int axis, double size) {
  double sum = 0;
  for (int k = 0; k < 3; ++k)
    sum += std::sin(2 * kPi * (8.3 + 1.4 * k + 0.37 * axis) * time_s + 1.7 * axis + 2.1 * k);
  return size * sum / 2.2;
}

}  // namespace

ObjectPath::ObjectPath(const ObjectOptions& options, double half_height_mm)
    : options_(options), half_height_mm_(half_height_mm) {
  if (options.path.ends_with(".csv")) read(options.path);
}

double ObjectPath::duration_s() const {
  return rows_.empty() ? kWait_s + kPress_s + options_.seconds + kLift_s + kRest_s : rows_.back().time_s;
}

Vector6d ObjectPath::place(double s, double deep) const {
  const ObjectOptions& o = options_;
  const double turn = o.turn_deg * kDegree, way = o.speed_mm_s * s / o.reach_mm;
  Vector6d p;
  p << 0, 0, deep * (o.depth_mm + kApproach_mm) - kApproach_mm, 0, 0, turn * std::sin(0.33 * s);
  if (o.path == "slide") {
    p[0] = o.reach_mm * std::sin(way);
    p[1] = 0.6 * o.reach_mm * std::sin(0.61 * way);
  } else if (o.path == "turn") {
    // The speed is that of what is 5 mm from the axis.
    if (turn > 0) p[5] = turn * std::sin(o.speed_mm_s / 5 * s / turn);
  } else if (o.path == "roll") {
    // Once round and back, about the middle of the picture.
    const double round_mm = 2 * kPi * half_height_mm_;
    p[0] = round_mm / 2 * -std::cos(2 * o.speed_mm_s * s / round_mm);
    p[4] = -(p[0] + round_mm / 2) / half_height_mm_;
  } else if (o.path == "drag") {
    p[0] = dragged_mm(s, o.reach_mm, o.speed_mm_s);
  } else {
    // A hand: no two of its swings have a common period; it drifts, and its press is not even.
    p[0] = o.reach_mm * (0.7 * std::sin(way) + 0.3 * std::sin(0.37 * way)) + 0.03 * s;
    p[1] = o.reach_mm * (0.4 * std::sin(0.53 * way) + 0.2 * std::sin(0.83 * way)) - 0.02 * s;
    p[2] += 0.1 * o.depth_mm * deep * std::sin(1.3 * s);
    for (int axis = 0; axis < 3; ++axis)
      p[axis] += tremor(s, axis, axis < 2 ? o.tremor_mm : 0.2 * o.tremor_mm);
    p[5] += 0.02 * o.tremor_mm * std::sin(2 * kPi * 9.1 * s);
  }
  p[0] += o.x_mm;
  p[1] += o.y_mm;
  return p;
}

RigidMotion ObjectPath::at(double time_s) const {
  if (!rows_.empty()) return on_rows(time_s);
  const double lift_s = kWait_s + kPress_s + options_.seconds;
  const double path_s = std::clamp(time_s - kWait_s - kPress_s, 0.0, options_.seconds);
  const Vector6d p = place(path_s, time_s < lift_s ? smooth_step((time_s - kWait_s) / kPress_s)
                                                   : 1 - smooth_step((time_s - lift_s) / kLift_s));
  const double tilt = options_.tilt_deg * kDegree;
  Vector6d tilting = Vector6d::Zero(), turning = Vector6d::Zero(), rolling = Vector6d::Zero();
  tilting.segment<2>(3) << tilt * std::sin(0.7 * path_s), tilt * std::sin(0.4 * path_s);
  tilting[2] = p[2];
  turning[5] = p[5];
  turning.head<2>() = p.head<2>();
  rolling[4] = p[4];
  const Eigen::Vector3d middle(0, 0, -half_height_mm_), origin(0, 0, 0);
  return motion_about(origin, tilting) * motion_about(origin, turning) * motion_about(middle, rolling);
}

RigidMotion ObjectPath::on_rows(double time_s) const {
  const auto after = std::ranges::upper_bound(rows_, time_s, {}, &Row::time_s);
  Vector6d p = after == rows_.begin() ? rows_.front().place : (after - 1)->place;
  if (after != rows_.begin() && after != rows_.end()) {
    const Row& before = *(after - 1);
    p += (time_s - before.time_s) / (after->time_s - before.time_s) * (after->place - before.place);
  }
  return {turn_of(p.tail<3>()), p.head<3>()};
}

void ObjectPath::read(const std::filesystem::path& file) {
  constexpr size_t kMostRows = 1'000'000;
  CsvTable table(file, "a path of an object");
  const std::vector<size_t> columns =
      table.require({"t_s", "x_mm", "y_mm", "z_mm", "rx_deg", "ry_deg", "rz_deg"});
  const auto refuse = [&](const std::string& wanted, const std::string& found) {
    throw Error(Failure::Input, "a path of an object with " + wanted, found + " in " + file.string(),
                "t_s,x_mm,y_mm,z_mm,rx_deg,ry_deg,rz_deg with rising times from 0 on");
  };
  while (table.next()) {
    Row row{table.number(columns[0]), Vector6d::Zero()};
    for (int k = 0; k < 6; ++k) row.place[k] = table.number(columns[k + 1]) * (k < 3 ? 1 : kDegree);
    if (row.time_s < 0 || (!rows_.empty() && row.time_s <= rows_.back().time_s))
      refuse("times that rise from 0 on", table.cell(columns[0]) + " s at " + table.where());
    if (row.time_s > 3600) refuse("an hour at most", table.cell(columns[0]) + " s");
    if (row.place.head<3>().cwiseAbs().maxCoeff() > 1000 || row.place.tail<3>().cwiseAbs().maxCoeff() > 1e4)
      refuse("places within 1000 mm and turns within 10000 rad", table.where());
    if (rows_.size() == kMostRows) refuse("a million rows at most", "more");
    rows_.push_back(row);
  }
  if (rows_.size() < 2) refuse("two rows or more", std::to_string(rows_.size()));
}

}  // namespace palpate

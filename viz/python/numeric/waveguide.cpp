// The pad as a waveguide: what its layers hold, what becomes of an LED's light, what contacts let out.
#include <pybind11/stl.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "engine/optics/edge_light.h"
#include "engine/optics/ray_fan.h"
#include "engine/optics/refractive_index.h"
#include "viz/python/arrays.h"
#include "viz/python/bindings.h"
#include "viz/python/waiting.h"

namespace palpate::python {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

double degrees(double rad) {
  return rad * 180 / std::numbers::pi;
}
/// 90 deg is half of pi to the last bit.
double radians(double deg) {
  return deg == 90 ? std::numbers::pi / 2 : deg * std::numbers::pi / 180;
}

optics::Waveguide guide_of(const std::vector<double>& indices, const std::vector<double>& thickness_mm) {
  if (indices.size() < 3)
    throw bad_argument("three indices or more: outside of the touched face, layers, outside",
                       std::to_string(indices.size()), "[1, 1.39, 1.40, 1.41, 1]");
  if (thickness_mm.size() + 2 != indices.size())
    throw bad_argument("a thickness for each of " + std::to_string(indices.size() - 2) + " layers",
                       std::to_string(thickness_mm.size()), "one number for all");
  optics::Waveguide guide;
  guide.above = indices.front();
  guide.below = indices.back();
  for (size_t i = 0; i < thickness_mm.size(); ++i) guide.layers.push_back({indices[i + 1], thickness_mm[i]});
  optics::check_waveguide(guide);
  return guide;
}

/// Layer (from 0; none: the middle), index at the edge, order, angle of half intensity and largest angle.
using LedTuple =
    std::tuple<std::optional<int64_t>, double, std::optional<double>, std::optional<double>, double>;

optics::EdgeLamp lamp_of(const LedTuple& led, const optics::Waveguide& guide) {
  const auto& [layer, edge_index, order, half_intensity_deg, half_angle_deg] = led;
  optics::EdgeLamp lamp;
  const auto count = static_cast<int64_t>(guide.layers.size());
  const int64_t chosen = layer.value_or(static_cast<int64_t>(optics::middle_layer(guide)));
  if (chosen < 0 || chosen >= count)
    throw bad_argument("a layer of the LED from 0 to " + std::to_string(count - 1), std::to_string(chosen),
                       "0 for the layer that is touched");
  if (order && half_intensity_deg)
    throw bad_argument("order or half_intensity_deg of the LED", "both", "the one of its data sheet");
  lamp.layer = static_cast<size_t>(chosen);
  lamp.edge_index = edge_index;
  if (order) lamp.order = *order;
  if (half_intensity_deg) lamp.order = optics::order_from_half_intensity(radians(*half_intensity_deg));
  lamp.half_angle_rad = radians(half_angle_deg);
  optics::check_lamp(guide, lamp);
  return lamp;
}

py::tuple critical(const std::vector<double>& n_in, const std::vector<double>& n_out) {
  std::vector<double> angle_deg, aperture;
  for (size_t i = 0; i < n_in.size(); ++i) {
    const std::optional<double> rad = optics::critical_angle_rad(n_in[i], n_out[i]);
    angle_deg.push_back(rad ? degrees(*rad) : kNone);
    aperture.push_back(optics::numerical_aperture(n_in[i], n_out[i]));
  }
  return py::make_tuple(hand_out(std::move(angle_deg)), hand_out(std::move(aperture)));
}

/// Amplitudes r_s, r_p, t_s, t_p at each angle.
py::tuple fresnel(double from, double to, double extinction, const std::vector<double>& angle_deg) {
  const optics::OpticalIndex first = optics::optical_index(from),
                             second = optics::optical_index(to, extinction);
  std::vector<std::complex<double>> parts[4];
  for (const double angle : angle_deg) {
    if (!(angle >= 0 && angle <= 90))
      throw bad_argument("angles of incidence from 0 to 90 deg", std::to_string(angle) + " deg",
                         "angles from the normal");
    const optics::FresnelAmplitudes a =
        optics::fresnel_amplitudes(first, second, from * std::sin(radians(angle)));
    const std::complex<double> all[] = {a.r_s, a.r_p, a.t_s, a.t_p};
    for (size_t k = 0; k < 4; ++k) parts[k].push_back(all[k]);
  }
  py::tuple given(4);
  for (size_t k = 0; k < 4; ++k) given[k] = hand_out(std::move(parts[k]));
  return given;
}

/// Transmittance of s, p and unpolarised light, row by row.
py::array gap(double from, double between, double to, double extinction, double wavelength_nm,
              const std::vector<double>& angle_deg, const std::vector<double>& gap_nm) {
  optics::optical_index(from);
  const size_t count = angle_deg.size();
  std::vector<double> passed(3 * count);
  for (size_t i = 0; i < count; ++i) {
    if (!(angle_deg[i] >= 0 && angle_deg[i] <= 90))
      throw bad_argument("angles of incidence from 0 to 90 deg", std::to_string(angle_deg[i]) + " deg",
                         "angles from the normal");
    const double s = from * std::sin(radians(angle_deg[i]));
    const auto at = [&](optics::Polarisation polarisation) {
      return optics::frustrated_transmittance(from, between, optics::optical_index(to, extinction), s,
                                              gap_nm[i], wavelength_nm, polarisation);
    };
    passed[i] = at(optics::Polarisation::S);
    passed[count + i] = at(optics::Polarisation::P);
    passed[2 * count + i] = (passed[i] + passed[count + i]) / 2;
  }
  return hand_out(std::move(passed), {3, static_cast<py::ssize_t>(count)});
}

py::dict critical_of_layers(const std::vector<double>& indices, std::optional<double> edge_index) {
  const optics::Waveguide guide =
      guide_of(indices, std::vector<double>(std::max<size_t>(indices.size(), 2) - 2, 1.0));
  const double edge = edge_index.value_or(optics::outside_index(guide));
  const std::vector<optics::LayerGuidance> found = optics::guidance(guide, edge);
  std::vector<double> guided, touching;
  const auto angle = [](const std::optional<double>& rad) { return rad ? degrees(*rad) : kNone; };
  const auto range = [](std::vector<double>& list, double from, double to) {
    list.push_back(from < to ? from : kNone);
    list.push_back(from < to ? to : kNone);
  };
  using Layer = optics::LayerGuidance;
  for (const Layer& l : found) {
    range(guided, l.guided_from, l.guided_to);
    range(touching, l.touching_from, l.touching_to);
  }
  const auto count = static_cast<py::ssize_t>(found.size());
  py::dict d;
  d["edge_index"] = edge;
  d["index"] = column(guide.layers, [](const auto& layer) { return layer.index; });
  d["critical_angle_above_deg"] = column(found, [&](const Layer& l) { return angle(l.critical_above_rad); });
  d["critical_angle_below_deg"] = column(found, [&](const Layer& l) { return angle(l.critical_below_rad); });
  d["numerical_aperture"] = column(found, &Layer::numerical_aperture);
  d["acceptance_half_angle_deg"] =
      column(found, [](const Layer& l) { return degrees(l.accepts.half_angle_rad); });
  d["accepts_all"] = column(found, [](const Layer& l) { return l.accepts.all; });
  d["guided_n_sin"] = hand_out(std::move(guided), {count, 2});
  d["touching_n_sin"] = hand_out(std::move(touching), {count, 2});
  return d;
}

/// A LED's fractions for each of many guides, whose indices stand row by row.
py::dict trapped(const std::vector<std::vector<double>>& indices, const std::vector<double>& thickness_mm,
                 const LedTuple& led) {
  std::vector<optics::LampFractions> found;
  for (const std::vector<double>& row : indices) {
    const optics::Waveguide guide = guide_of(row, thickness_mm);
    found.push_back(optics::lamp_fractions(guide, lamp_of(led, guide)));
  }
  py::dict d;
  d["entering"] = column(found, &optics::LampFractions::entering);
  d["guided"] = column(found, &optics::LampFractions::guided);
  d["touching"] = column(found, &optics::LampFractions::touching);
  d["arriving_per_mm"] = column(found, &optics::LampFractions::arriving_per_mm);
  return d;
}

/// One contact a row: index, extinction, albedo, gap (nm). The first row is the reference.
py::dict contact(const std::vector<double>& indices, const std::vector<double>& thickness_mm,
                 const LedTuple& led, const std::vector<std::array<double, 4>>& contacts,
                 double wavelength_nm, std::optional<double> reference_gray, double most_gray) {
  const optics::Waveguide guide = guide_of(indices, thickness_mm);
  const optics::EdgeLamp lamp = lamp_of(led, guide);
  const auto light_of = [&](const std::array<double, 4>& c) {
    return optics::contact_light(guide, lamp, {optics::optical_index(c[0], c[1]), c[3], wavelength_nm});
  };
  optics::GrayReference reference;
  reference.light = light_of(contacts.front());
  reference.albedo = contacts.front()[2];
  reference.gray = reference_gray.value_or(1);
  reference.most_gray = reference_gray ? most_gray : std::numeric_limits<double>::max();
  std::vector<optics::ContactLight> lights;
  std::vector<optics::PredictedGray> grays;
  for (auto c = contacts.begin() + 1; c != contacts.end(); ++c) {
    lights.push_back(light_of(*c));
    grays.push_back(optics::predict_gray(reference, lights.back(), (*c)[2]));
  }
  py::dict d;
  d["leaving_per_meeting"] = column(lights, &optics::ContactLight::per_meeting);
  d["leaving_per_mm"] = column(lights, &optics::ContactLight::leaving_per_mm);
  d["leaves_up_to_deg"] = column(lights, [&](const optics::ContactLight& light) {
    const double sine = std::min(1.0, light.reached_to / guide.layers.front().index);
    return light.leaving_per_mm > 0 ? degrees(std::asin(sine)) : kNone;
  });
  d["relative"] = column(grays, [&](const optics::PredictedGray& g) { return g.unlimited / reference.gray; });
  d["gray"] = column(grays, [&](const optics::PredictedGray& g) { return reference_gray ? g.gray : kNone; });
  d["saturated"] = column(grays, &optics::PredictedGray::saturated);
  return d;
}

struct LedLight {
  optics::LampFractions fractions;
  optics::FirstMeetings meetings;
  std::vector<optics::EdgeRay> rays;
};

py::dict led(const std::vector<double>& indices, const std::vector<double>& thickness_mm,
             const LedTuple& given, std::optional<double> depth_mm, double length_mm,
             const std::vector<double>& angle_deg) {
  const optics::Waveguide guide = guide_of(indices, thickness_mm);
  optics::EdgeLamp lamp = lamp_of(given, guide);
  const double depth = depth_mm.value_or(optics::middle_depth_mm(guide, lamp.layer));
  if (depth_mm) {
    const size_t layer = optics::layer_at(guide, depth);
    if (std::get<0>(given) && layer != lamp.layer)
      throw bad_argument("depth_mm in the layer of the LED", "one in layer " + std::to_string(layer),
                         "one of the two");
    lamp.layer = layer;
  }
  LedLight light = run_apart([=](const std::atomic<bool>&) {
    LedLight found;
    found.fractions = optics::lamp_fractions(guide, lamp);
    found.meetings = optics::first_meetings(guide, lamp, depth, length_mm);
    for (const double angle : angle_deg)
      found.rays.push_back(optics::trace_ray(guide, lamp, depth, radians(angle), length_mm));
    return found;
  });
  using Ray = optics::EdgeRay;
  py::list fates, paths;
  for (const Ray& ray : light.rays) {
    fates.append(to_string(ray.fate));
    std::vector<double> path;
    for (size_t i = 0; i < ray.x_mm.size(); ++i) {
      path.push_back(ray.x_mm[i]);
      path.push_back(ray.depth_mm[i]);
    }
    paths.append(hand_out(std::move(path), {static_cast<py::ssize_t>(ray.x_mm.size()), 2}));
  }
  py::dict d;
  d["layer"] = lamp.layer;
  d["depth_mm"] = depth;
  d["entering"] = light.fractions.entering;
  d["guided"] = light.fractions.guided;
  d["touching"] = light.fractions.touching;
  d["nearest_mm"] = light.meetings.nearest_mm;
  d["half_mm"] = light.meetings.distance_of(0.5, light.fractions.touching);
  d["nine_tenths_mm"] = light.meetings.distance_of(0.9, light.fractions.touching);
  d["distance_mm"] = hand_out(std::move(light.meetings.distance_mm));
  d["fraction"] = hand_out(std::move(light.meetings.fraction));
  d["n_sin"] = column(light.rays, &Ray::tangential_index);
  d["fate"] = fates;
  d["ray_entering"] = column(light.rays, &Ray::entering);
  d["first_mm"] = column(light.rays, &Ray::first_mm);
  d["hop_mm"] = column(light.rays, &Ray::hop_mm);
  d["path_mm"] = paths;
  return d;
}

/// One measurement a row: OD, ON, M1M2, NM2.
py::dict index(const std::vector<std::array<double, 4>>& lengths_mm, const std::array<double, 4>& sd_mm,
               double air_index, double air_index_sd) {
  std::vector<optics::MeasuredIndex> parts;
  for (const std::array<double, 4>& l : lengths_mm) {
    optics::LaserSpots spots;
    spots.od = {l[0], sd_mm[0]};
    spots.on = {l[1], sd_mm[1]};
    spots.m1m2 = {l[2], sd_mm[2]};
    spots.nm2 = {l[3], sd_mm[3]};
    spots.n_air = air_index;
    spots.n_air_sd = air_index_sd;
    parts.push_back(optics::index_from_spots(spots));
  }
  const optics::CombinedIndex together = optics::combine(parts);
  using One = optics::MeasuredIndex;
  std::vector<double> by_length;
  for (const One& m : parts)
    by_length.insert(by_length.end(), {m.sd_od, m.sd_on, m.sd_m1m2, m.sd_nm2, m.sd_air});
  const auto count = static_cast<py::ssize_t>(parts.size());
  py::dict d;
  d["index"] = together.index;
  d["standard_error"] = together.standard_error;
  d["chi_square"] = together.chi_square;
  d["widened"] = together.widened;
  d["each"] = column(parts, &One::index);
  d["each_sd"] = column(parts, &One::standard_error);
  d["incidence_deg"] = column(parts, [](const One& m) { return degrees(m.incidence_rad); });
  d["refraction_deg"] = column(parts, [](const One& m) { return degrees(m.refraction_rad); });
  d["parts_sd"] = hand_out(std::move(by_length), {count, 5});
  return d;
}

}  // namespace

void bind_waveguide(py::module_& module) {
  bind_function(module, "optics_critical", &critical, "n_in n_out");
  bind_function(module, "optics_fresnel", &fresnel, "n_from n_to extinction angle_deg");
  bind_function(module, "optics_gap", &gap, "n_from n_gap n_to extinction wavelength_nm angle_deg gap_nm");
  bind_function(module, "optics_layers", &critical_of_layers, "indices edge_index");
  bind_function(module, "optics_trapped", &trapped, "indices thickness_mm led");
  bind_function(module, "optics_contact", &contact,
                "indices thickness_mm led contacts wavelength_nm reference_gray most_gray");
  bind_function(module, "optics_led", &led, "indices thickness_mm led depth_mm length_mm angle_deg");
  bind_function(module, "optics_index", &index, "lengths_mm sd_mm air_index air_index_sd");
}

}  // namespace palpate::python

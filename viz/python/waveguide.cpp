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
#include "viz/python/numeric.h"
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

py::array of(std::vector<double> values) {
  const auto count = static_cast<py::ssize_t>(values.size());
  return hand_out(std::move(values), {count});
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
  return py::make_tuple(of(std::move(angle_deg)), of(std::move(aperture)));
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
  const auto count = static_cast<py::ssize_t>(angle_deg.size());
  py::tuple given(4);
  for (size_t k = 0; k < 4; ++k) given[k] = hand_out(std::move(parts[k]), {count});
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
  std::vector<double> index, above, below, aperture, accepts, guided, touching;
  std::vector<uint8_t> all;
  const auto angle = [](const std::optional<double>& rad) { return rad ? degrees(*rad) : kNone; };
  const auto range = [](std::vector<double>& list, double from, double to) {
    list.push_back(from < to ? from : kNone);
    list.push_back(from < to ? to : kNone);
  };
  for (size_t i = 0; i < found.size(); ++i) {
    const optics::LayerGuidance& l = found[i];
    index.push_back(guide.layers[i].index);
    above.push_back(angle(l.critical_above_rad));
    below.push_back(angle(l.critical_below_rad));
    aperture.push_back(l.numerical_aperture);
    accepts.push_back(degrees(l.accepts.half_angle_rad));
    all.push_back(l.accepts.all);
    range(guided, l.guided_from, l.guided_to);
    range(touching, l.touching_from, l.touching_to);
  }
  const auto count = static_cast<py::ssize_t>(found.size());
  py::dict d;
  d["edge_index"] = edge;
  d["index"] = of(std::move(index));
  d["critical_angle_above_deg"] = of(std::move(above));
  d["critical_angle_below_deg"] = of(std::move(below));
  d["numerical_aperture"] = of(std::move(aperture));
  d["acceptance_half_angle_deg"] = of(std::move(accepts));
  d["accepts_all"] = py::array(hand_out(std::move(all), {count})).attr("view")("bool");
  d["guided_n_sin"] = hand_out(std::move(guided), {count, 2});
  d["touching_n_sin"] = hand_out(std::move(touching), {count, 2});
  return d;
}

/// A LED's fractions for each of many guides, whose indices stand row by row.
py::dict trapped(const std::vector<std::vector<double>>& indices, const std::vector<double>& thickness_mm,
                 const LedTuple& led) {
  std::vector<double> entering, guided, touching, arriving;
  for (const std::vector<double>& row : indices) {
    const optics::Waveguide guide = guide_of(row, thickness_mm);
    const optics::LampFractions f = optics::lamp_fractions(guide, lamp_of(led, guide));
    entering.push_back(f.entering);
    guided.push_back(f.guided);
    touching.push_back(f.touching);
    arriving.push_back(f.arriving_per_mm);
  }
  py::dict d;
  d["entering"] = of(std::move(entering));
  d["guided"] = of(std::move(guided));
  d["touching"] = of(std::move(touching));
  d["arriving_per_mm"] = of(std::move(arriving));
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
  std::vector<double> meeting, per_mm, up_to_deg, relative, gray;
  std::vector<uint8_t> saturated;
  for (auto c = contacts.begin() + 1; c != contacts.end(); ++c) {
    const optics::ContactLight light = light_of(*c);
    const optics::PredictedGray predicted = optics::predict_gray(reference, light, (*c)[2]);
    meeting.push_back(light.per_meeting);
    per_mm.push_back(light.leaving_per_mm);
    up_to_deg.push_back(light.leaving_per_mm > 0
                            ? degrees(std::asin(std::min(1.0, light.reached_to / guide.layers.front().index)))
                            : kNone);
    relative.push_back(predicted.unlimited / reference.gray);
    gray.push_back(reference_gray ? predicted.gray : kNone);
    saturated.push_back(predicted.saturated);
  }
  const auto count = static_cast<py::ssize_t>(saturated.size());
  py::dict d;
  d["leaving_per_meeting"] = of(std::move(meeting));
  d["leaving_per_mm"] = of(std::move(per_mm));
  d["leaves_up_to_deg"] = of(std::move(up_to_deg));
  d["relative"] = of(std::move(relative));
  d["gray"] = of(std::move(gray));
  d["saturated"] = py::array(hand_out(std::move(saturated), {count})).attr("view")("bool");
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
  std::vector<double> n_sin, entering, first, hop;
  py::list fates, paths;
  for (optics::EdgeRay& ray : light.rays) {
    n_sin.push_back(ray.tangential_index);
    entering.push_back(ray.entering);
    first.push_back(ray.first_mm);
    hop.push_back(ray.hop_mm);
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
  d["distance_mm"] = of(std::move(light.meetings.distance_mm));
  d["fraction"] = of(std::move(light.meetings.fraction));
  d["n_sin"] = of(std::move(n_sin));
  d["fate"] = fates;
  d["ray_entering"] = of(std::move(entering));
  d["first_mm"] = of(std::move(first));
  d["hop_mm"] = of(std::move(hop));
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
  std::vector<double> each, sd, incidence, refraction, by_length;
  for (const optics::MeasuredIndex& m : parts) {
    each.push_back(m.index);
    sd.push_back(m.standard_error);
    incidence.push_back(degrees(m.incidence_rad));
    refraction.push_back(degrees(m.refraction_rad));
    for (const double part : {m.sd_od, m.sd_on, m.sd_m1m2, m.sd_nm2, m.sd_air}) by_length.push_back(part);
  }
  const auto count = static_cast<py::ssize_t>(parts.size());
  py::dict d;
  d["index"] = together.index;
  d["standard_error"] = together.standard_error;
  d["chi_square"] = together.chi_square;
  d["widened"] = together.widened;
  d["each"] = of(std::move(each));
  d["each_sd"] = of(std::move(sd));
  d["incidence_deg"] = of(std::move(incidence));
  d["refraction_deg"] = of(std::move(refraction));
  d["parts_sd"] = hand_out(std::move(by_length), {count, 5});
  return d;
}

}  // namespace

void bind_waveguide(py::module_& module) {
  module.def("optics_critical", &critical, py::arg("n_in"), py::arg("n_out"));
  module.def("optics_fresnel", &fresnel, py::arg("n_from"), py::arg("n_to"), py::arg("extinction"),
             py::arg("angle_deg"));
  module.def("optics_gap", &gap, py::arg("n_from"), py::arg("n_gap"), py::arg("n_to"), py::arg("extinction"),
             py::arg("wavelength_nm"), py::arg("angle_deg"), py::arg("gap_nm"));
  module.def("optics_layers", &critical_of_layers, py::arg("indices"), py::arg("edge_index"));
  module.def("optics_trapped", &trapped, py::arg("indices"), py::arg("thickness_mm"), py::arg("led"));
  module.def("optics_contact", &contact, py::arg("indices"), py::arg("thickness_mm"), py::arg("led"),
             py::arg("contacts"), py::arg("wavelength_nm"), py::arg("reference_gray"), py::arg("most_gray"));
  module.def("optics_led", &led, py::arg("indices"), py::arg("thickness_mm"), py::arg("led"),
             py::arg("depth_mm"), py::arg("length_mm"), py::arg("angle_deg"));
  module.def("optics_index", &index, py::arg("lengths_mm"), py::arg("sd_mm"), py::arg("air_index"),
             py::arg("air_index_sd"));
}

}  // namespace palpate::python

#include "viz/python/touch.h"

#include <pybind11/stl.h>

#include <cmath>
#include <cstring>
#include <limits>

#include "capture/files/measurements.h"
#include "engine/base/text.h"
#include "viz/python/arrays.h"
#include "viz/python/estimate.h"

namespace palpate::python {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

std::string slip_text(Slip slip) {
  return to_string(slip);
}

/// Rows x columns, or rows x columns x 3.
py::object pixels_of(std::vector<uint8_t> bytes, const FrameFormat& f) {
  const Shape planes = {f.channels, f.height, f.width};
  py::array array;
  if (f.bit_depth <= 8) {
    array = hand_out(std::move(bytes), planes);
  } else {
    std::vector<uint16_t> wide(bytes.size() / 2);
    std::memcpy(wide.data(), bytes.data(), bytes.size());
    array = hand_out(std::move(wide), planes);
  }
  if (f.channels == 1) return array.attr("reshape")(f.height, f.width);
  return array.attr("transpose")(1, 2, 0);
}

py::object skin_points_of(const Touch& touch) {
  std::vector<float> rows;
  rows.reserve(5 * touch.skin_points.size());
  for (const SkinPoint& p : touch.skin_points)
    rows.insert(rows.end(), {p.rest_x_px, p.rest_y_px, p.shift_x_px, p.shift_y_px, p.correlation});
  return hand_out(std::move(rows), {static_cast<py::ssize_t>(touch.skin_points.size()), 5});
}

struct PyTruth {
  Truth truth;
};

struct PyWrench {
  TractionSummary summary;
};

Estimate depth_of(const Touch& touch) {
  if (!touch.surface) return {};
  const SurfaceSummary& s = *touch.surface;
  return {s.depth_max_mm, s.depth_sd_mm > 0 ? s.depth_sd_mm : kNone,
          touch.contact ? s.validity : Validity::NoContact};
}

/// What is known of it, first what is calibrated; where it is from.
std::string described(const PyTouch& t) {
  const Touch& touch = t.touch();
  std::string line = text("<palpate.Touch %llu at %.3f s", static_cast<unsigned long long>(touch.sequence),
                          1e-9 * static_cast<double>(touch.time_ns));
  if (!t.held().file().empty()) line += " of '" + t.held().file() + "'";
  if (touch.picture != PictureFault::None) return line + ": picture " + to_string(touch.picture) + ">";
  if (!touch.contact) return line + ": no contact>";
  std::string known;
  const auto add = [&known](const std::string& words) { known += (known.empty() ? "" : ", ") + words; };
  if (touch.force_N.validity != Validity::NotCalibrated) add(measured(touch.force_N, "N").text());
  if (touch.surface) add(measured(depth_of(touch), "mm").text() + " deep");
  if (touch.slip != Slip::NotCalibrated) add(slip_text(touch.slip));
  return line + ": " + (known.empty() ? "contact" : known) + ">";
}

std::string as_html(const PyTouch& t) {
  const Touch& touch = t.touch();
  std::string rows;
  const auto row = [&rows](const char* name, const std::string& value) {
    rows += std::string("<tr><th style='text-align:left'>") + name + "</th><td>" + value + "</td></tr>";
  };
  row("frame", std::to_string(touch.sequence));
  row("time", text("%.3f s", 1e-9 * static_cast<double>(touch.time_ns)));
  row("force", measured(touch.force_N, "N").text());
  row("shear x", measured(touch.shear_x_N, "N").text());
  row("shear y", measured(touch.shear_y_N, "N").text());
  row("slip", slip_text(touch.slip));
  if (touch.surface)
    row("depth",
        measured(touch.surface->depth_max_mm, touch.surface->depth_sd_mm, touch.surface->validity, "mm")
            .text());
  row("contacts", std::to_string(touch.contacts.size()));
  return "<table>" + rows + "</table>";
}

template <typename Class>
void bind_ellipse(Class& bound, const Ellipse& (*of)(const typename Class::type&)) {
  using T = typename Class::type;
  const auto add = [&bound, of](const char* name, double Ellipse::*field) {
    bound.def_property_readonly(name, [of, field](const T& t) { return of(t).*field; });
  };
  add("ellipse_major_mm", &Ellipse::major_mm);
  add("ellipse_minor_mm", &Ellipse::minor_mm);
  add("ellipse_major_px", &Ellipse::major_px);
  add("ellipse_minor_px", &Ellipse::minor_px);
  add("ellipse_angle_rad", &Ellipse::angle_rad);
}

/// What a frame's whole touch and one contact have in common; `of` gives its numbers.
template <typename Class, typename Shape>
void bind_shape(Class& bound, const Shape& (*of)(const typename Class::type&)) {
  using T = typename Class::type;
  const auto field = [&bound, of](const char* name, auto member) {
    bound.def_property_readonly(name, [of, member](const T& t) { return of(t).*member; });
  };
  const auto estimate = [&bound, of](const char* name, Estimate Shape::*member) {
    bound.def_property_readonly(name, [of, member](const T& t) { return measured(of(t).*member, "N"); });
  };
  field("gray_sum", &Shape::gray_sum);
  field("centroid_x_px", &Shape::centroid_x_px);
  field("centroid_y_px", &Shape::centroid_y_px);
  field("area_px", &Shape::area_px);
  field("area_mm2", &Shape::area_mm2);
  field("peak_gray", &Shape::peak_gray);
  field("saturated_px", &Shape::saturated_px);
  field("at_border", &Shape::at_border);
  field("shift_x_mm", &Shape::shift_x_mm);
  field("shift_y_mm", &Shape::shift_y_mm);
  field("shift_x_px", &Shape::shift_x_px);
  field("shift_y_px", &Shape::shift_y_px);
  estimate("force_N", &Shape::force_N);
  estimate("shear_x_N", &Shape::shear_x_N);
  estimate("shear_y_N", &Shape::shear_y_N);
  bound.def_property_readonly("slip", [of](const T& t) { return slip_text(of(t).slip); });
}

void bind_contact(py::module_& module) {
  py::class_<ContactTouch> bound(module, "Contact");
  bind_shape<py::class_<ContactTouch>, ContactTouch>(
      bound, [](const ContactTouch& c) -> const ContactTouch& { return c; });
  bind_ellipse(
      bound, +[](const ContactTouch& c) -> const Ellipse& { return c.ellipse; });
  bound.def_readonly("id", &ContactTouch::id)
      .def_readonly("frames", &ContactTouch::frames)
      .def_property_readonly(
          "box_px",
          [](const ContactTouch& c) { return py::make_tuple(c.box.x, c.box.y, c.box.width, c.box.height); })
      .def("__repr__", [](const ContactTouch& c) {
        return text("<palpate.Contact %u at (%.1f, %.1f) px: ", c.id, c.centroid_x_px, c.centroid_y_px) +
               measured(c.force_N, "N").text() + ">";
      });
}

void bind_truth(py::module_& module) {
  py::class_<PyTruth> bound(module, "Truth");
  const auto field = [&bound](const char* name, auto member) {
    bound.def_property_readonly(name, [member](const PyTruth& t) { return t.truth.*member; });
  };
  field("sequence", &Truth::sequence);
  field("time_s", &Truth::time_s);
  field("contact", &Truth::contact);
  field("force_N", &Truth::force_N);
  field("shear_x_N", &Truth::shear_x_N);
  field("shear_y_N", &Truth::shear_y_N);
  field("slipping", &Truth::slipping);
  field("center_x_px", &Truth::center_x_px);
  field("center_y_px", &Truth::center_y_px);
  field("radius_px", &Truth::radius_px);
  field("depth_max_mm", &Truth::indentation_mm);
  field("stick_fraction", &Truth::stick_fraction);
  field("torsion_rad", &Truth::torsion_rad);
  field("volume_mm3", &Truth::volume_mm3);
}

void bind_wrench(py::module_& module) {
  py::class_<PyWrench> bound(module, "Wrench");
  const auto estimate = [&bound](const char* name, Estimate TractionSummary::*member, const char* unit) {
    bound.def_property_readonly(
        name, [member, unit](const PyWrench& w) { return measured(w.summary.*member, unit); });
  };
  estimate("force_x_N", &TractionSummary::force_x_N, "N");
  estimate("force_y_N", &TractionSummary::force_y_N, "N");
  estimate("force_z_N", &TractionSummary::force_z_N, "N");
  estimate("moment_x_Nmm", &TractionSummary::moment_x_Nmm, "N mm");
  estimate("moment_y_Nmm", &TractionSummary::moment_y_Nmm, "N mm");
  estimate("moment_z_Nmm", &TractionSummary::moment_z_Nmm, "N mm");
  const auto number = [&bound](const char* name, double TractionSummary::*member) {
    bound.def_property_readonly(name, [member](const PyWrench& w) {
      return has_value(w.summary.force_z_N) ? w.summary.*member : kNone;
    });
  };
  number("pressure_max_kPa", &TractionSummary::pressure_max_kPa);
  number("shear_max_kPa", &TractionSummary::shear_max_kPa);
  number("area_mm2", &TractionSummary::area_mm2);
  number("unexplained_slope", &TractionSummary::unexplained_slope);
  bound
      .def_property_readonly("slipping_fraction",
                             [](const PyWrench& w) { return w.summary.slipping_fraction; })
      .def("__repr__", [](const PyWrench& w) {
        return "<palpate.Wrench force_z " + measured(w.summary.force_z_N, "N").text() + ">";
      });
}

}  // namespace

/// What `make` makes of what `read` reads of the frame, without the interpreter's lock; kept from then on.
template <typename Read, typename Make>
py::object PyTouch::once(py::object& kept, const char* name, Read read, Make make) {
  if (kept) return kept;
  std::invoke_result_t<Read, const Pipeline&, const Result&, const Frame&> value;
  bool there = false;
  {
    const py::gil_scoped_release release;
    there = held_->read([&](const Pipeline& pipeline, const Result& result, const Frame& frame) {
      value = read(pipeline, result, frame);
    });
  }
  if (!there)
    throw Refusal{"ExpiredError", std::string(name) + " of frame " + std::to_string(touch().sequence),
                  "a stream that has moved on: the memory holds another frame",
                  std::string("reading it before the next frame, touch.keep(\"") + name +
                      "\"), or palpate.open(..., keep=[\"" + name + "\"])"};
  if (!kept) kept = make(std::move(value));
  return kept;
}

py::object PyTouch::depth_mm() {
  if (!touch().surface)
    throw Refusal{"SensorError", "depth_mm", "a sensor that measures no surface, or outputs without it",
                  "a sensor file with \"surface\", or outputs=[\"force\", \"surface\"]"};
  return once(
      depth_, "depth_mm",
      [](const Pipeline& pipeline, const Result& result, const Frame&) {
        return pipeline.read_depth_mm(result);
      },
      [this](std::vector<float> depth) { return hand_out(std::move(depth), shape()); });
}

py::object PyTouch::image() {
  return once(
      image_, "image",
      [](const Pipeline&, const Result&, const Frame& frame) {
        return std::vector<uint8_t>(frame.pixels(), frame.pixels() + frame.format.frame_bytes());
      },
      [this](std::vector<uint8_t> bytes) { return pixels_of(std::move(bytes), held_->format()); });
}

py::object PyTouch::confidence() {
  if (!touch().confidence)
    throw Refusal{"ArgumentError", "confidence", "outputs without it",
                  "outputs=[\"force\", \"surface\", \"confidence\"]"};
  return once(
      confidence_, "confidence",
      [](const Pipeline& pipeline, const Result& result, const Frame&) {
        return pipeline.read_confidence(result);
      },
      [this](std::vector<uint16_t> values) { return hand_out(std::move(values), shape()); });
}

void PyTouch::read_traction(const char* name) {
  if (!touch().traction)
    throw Refusal{"SensorError", name, "a sensor without an elastic layer, or other outputs",
                  "a sensor file with \"layer\" and outputs=[\"force\", \"surface\", \"traction\"]"};
  struct Copy {
    std::vector<float> pressure, shear;
    py::ssize_t rows = 0, columns = 0;
  };
  once(
      pressure_, name,
      [](const Pipeline&, const Result& result, const Frame&) {
        const TractionMaps& maps = result.traction;
        Copy copy{{maps.pressure_kPa.begin(), maps.pressure_kPa.end()},
                  {maps.shear_x_kPa.begin(), maps.shear_x_kPa.end()},
                  maps.height,
                  maps.width};
        copy.shear.insert(copy.shear.end(), maps.shear_y_kPa.begin(), maps.shear_y_kPa.end());
        return copy;
      },
      [this](Copy copy) -> py::object {
        shear_ = py::none();
        if (!copy.shear.empty()) shear_ = hand_out(std::move(copy.shear), {2, copy.rows, copy.columns});
        if (copy.pressure.empty()) return py::none();
        return hand_out(std::move(copy.pressure), {copy.rows, copy.columns});
      });
}

py::object PyTouch::pressure_kPa() {
  read_traction("pressure_kPa");
  return pressure_;
}

py::object PyTouch::shear_kPa() {
  read_traction("shear_kPa");
  return shear_;
}

void PyTouch::keep(const Kept& kept) {
  if (kept.depth) depth_mm();
  if (kept.image) image();
  if (kept.confidence) confidence();
  if (kept.traction) read_traction("pressure_kPa");
}

void bind_touch(py::module_& module) {
  bind_contact(module);
  bind_truth(module);
  bind_wrench(module);
  py::class_<PyTouch> bound(module, "Touch");
  bind_shape<py::class_<PyTouch>, Touch>(bound, [](const PyTouch& t) -> const Touch& { return t.touch(); });
  bind_ellipse(
      bound, +[](const PyTouch& t) -> const Ellipse& { return t.touch().ellipse; });
  bound.def_property_readonly("sequence", [](const PyTouch& t) { return t.touch().sequence; })
      .def_property_readonly("time_s",
                             [](const PyTouch& t) { return static_cast<double>(t.touch().time_ns) / 1e9; })
      .def_property_readonly("time_ns", [](const PyTouch& t) { return t.touch().time_ns; })
      .def_property_readonly("monotonic_s",
                             [](const PyTouch& t) {
                               const int64_t ns = t.held().exposed_ns();
                               return ns ? static_cast<double>(ns) / 1e9 : kNone;
                             })
      .def_property_readonly("source",
                             [](const PyTouch& t) {
                               const std::string& file = t.held().file();
                               return file.empty() ? std::optional<std::string>() : file;
                             })
      .def_property_readonly("contact", [](const PyTouch& t) { return t.touch().contact; })
      .def_property_readonly("contacts", [](const PyTouch& t) { return t.touch().contacts; })
      .def_property_readonly(
          "contacts_overflow",
          [](const PyTouch& t) { return t.touch().regions && t.touch().regions->overflow; })
      .def_property_readonly("gradient_sum", [](const PyTouch& t) { return t.touch().gradient_sum; })
      .def_property_readonly("picture", [](const PyTouch& t) { return to_string(t.touch().picture); })
      .def_property_readonly("repeated", [](const PyTouch& t) { return t.touch().repeated; })
      .def_property_readonly("light_state",
                             [](const PyTouch& t) {
                               const auto& light = t.touch().light;
                               return light ? std::optional<std::string>(to_string(light->state))
                                            : std::nullopt;
                             })
      .def_property_readonly("truth",
                             [](const PyTouch& t) {
                               std::optional<Truth> truth = t.held().truth();
                               return truth ? std::optional<PyTruth>(PyTruth{std::move(*truth)})
                                            : std::nullopt;
                             })
      .def_property_readonly("image", &PyTouch::image)
      .def_property_readonly("confidence", &PyTouch::confidence)
      .def("_keep",
           [](PyTouch& t, bool depth, bool image, bool confidence, bool traction) {
             t.keep({depth, image, confidence, traction});
           })
      .def("__repr__", &described)
      .def("_repr_html_", &as_html);
  // The surface.
  bound.def_property_readonly("depth_mm", &PyTouch::depth_mm)
      .def_property_readonly("depth_max_mm",
                             [](const PyTouch& t) {
                               const auto& s = t.touch().surface;
                               return s ? measured(s->depth_max_mm,
                                                   s->depth_sd_mm > 0 ? s->depth_sd_mm : kNone, s->validity,
                                                   "mm")
                                        : measured(Estimate{}, "mm");
                             })
      .def_property_readonly(
          "volume_mm3",
          [](const PyTouch& t) { return t.touch().surface ? t.touch().surface->volume_mm3 : kNone; })
      .def_property_readonly("dented_mm2", [](const PyTouch& t) {
        return t.touch().surface ? t.touch().surface->dented_mm2.value_or(kNone) : kNone;
      });
  // The skin.
  const auto skin = [&bound](const char* name, Estimate SkinMotion::*member, const char* unit) {
    bound.def_property_readonly(name, [member, unit](const PyTouch& t) {
      return measured(t.touch().skin ? (*t.touch().skin).*member : Estimate{}, unit);
    });
  };
  skin("skin_shift_x_mm", &SkinMotion::shift_x_mm, "mm");
  skin("skin_shift_y_mm", &SkinMotion::shift_y_mm, "mm");
  skin("torsion_rad", &SkinMotion::torsion_rad, "rad");
  skin("stick_fraction", &SkinMotion::stick_fraction, "");
  bound.def_property_readonly("skin_points", [](const PyTouch& t) { return skin_points_of(t.touch()); });
  // Traction.
  bound.def_property_readonly("pressure_kPa", &PyTouch::pressure_kPa)
      .def_property_readonly("shear_kPa", &PyTouch::shear_kPa)
      .def_property_readonly("wrench", [](const PyTouch& t) {
        return PyWrench{t.touch().traction.value_or(TractionSummary{})};
      });
}

}  // namespace palpate::python

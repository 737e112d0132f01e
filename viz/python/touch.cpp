#include "viz/python/touch.h"

#include <pybind11/stl.h>

#include <cmath>
#include <limits>

#include "engine/base/text.h"
#include "viz/python/arrays.h"
#include "viz/python/bind_quantities.h"
#include "viz/python/bindings.h"
#include "viz/python/estimate.h"
#include "viz/python/sensor.h"

namespace palpate::python {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

std::string slip_text(Slip slip) {
  return to_string(slip);
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
  std::shared_ptr<HeldFrame> held;
};

/// Of the object that touches the pad.
struct PyMotion {
  std::shared_ptr<HeldFrame> held;

  const ObjectPose& pose() const {
    if (const auto& object = held->touch().object) return *object;
    throw Refusal{"SensorError", "motion", "outputs without it, or separate pictures",
                  "outputs=[\"force\", \"surface\", \"motion\"], and rate_Hz or sequence=True for images"};
  }
};

Estimate depth_of(const Touch& touch) {
  if (!touch.surface) return {};
  const SurfaceSummary& s = *touch.surface;
  return {s.depth_max_mm, s.depth_sd_mm > 0 ? s.depth_sd_mm : kNone,
          touch.contact ? s.validity : Validity::NoContact};
}

/// Description of a touch: calibrated values first, then its source.
std::string touch_text(const PyTouch& t) {
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

void bind_contact(py::module_& module) {
  py::class_<ContactTouch> bound(module, "Contact");
  bind_quantities(bound, contact_quantities(),
                  [](const ContactTouch& c) -> const ContactTouch& { return c; });
  bound
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
  bind_quantities(bound, true_quantities(), [](const PyTruth& t) { return TrueFrame{&t.truth}; });
  bound.def_property_readonly("sequence", [](const PyTruth& t) { return t.truth.sequence; })
      .def_property_readonly("time_s", [](const PyTruth& t) { return t.truth.time_s; });
}

void bind_wrench(py::module_& module) {
  py::class_<PyWrench> bound(module, "Wrench");
  bind_quantities(
      bound, touch_quantities(), [](const PyWrench& w) -> const Touch& { return w.held->touch(); }, kWrench);
  bound.def("__repr__", [](const PyWrench& w) {
    const auto& traction = w.held->touch().traction;
    return "<palpate.Wrench fz " + measured(traction ? traction->fz_N : Estimate{}, "N").text() + ">";
  });
}

template <size_t Count>
py::object square_array(const std::array<double, Count>& values, py::ssize_t side) {
  return hand_out(std::vector<double>(values.begin(), values.end()), {side, side});
}

py::object pose_matrix(const ObjectPose& pose) {
  std::array<double, 16> rows{};
  for (size_t k = 0; k < 3; ++k) {
    for (size_t c = 0; c < 3; ++c) rows[4 * k + c] = pose.rotation[3 * k + c];
    rows[4 * k + 3] = pose.translation_mm[k];
  }
  rows[15] = 1;
  return square_array(rows, 4);
}

void bind_motion(py::module_& module) {
  py::class_<PyMotion> bound(module, "Motion");
  bind_quantities(
      bound, touch_quantities(), [](const PyMotion& m) -> const Touch& { return m.held->touch(); }, kMotion);
  bound.def_property_readonly("pose", [](const PyMotion& m) { return pose_matrix(m.pose()); })
      .def_property_readonly("covariance",
                             [](const PyMotion& m) { return square_array(m.pose().covariance, 6); })
      .def("__repr__", [](const PyMotion& m) {
        const auto& object = m.held->touch().object;
        if (!object) return std::string("<palpate.Motion not measured>");
        return text("<palpate.Motion %s, track %u>", to_string(object->state), object->track);
      });
}

/// For each quantity of a touch, its column, those of its error and state, its attribute and the attribute's
/// older name; "" where there is none.
py::list quantities() {
  py::list all;
  const auto add = [&all](const auto& list) {
    for (const auto& q : list)
      all.append(py::make_tuple(q.group ? q.name : "",
                                q.kind == QuantityKind::Estimated ? error_name(q) : std::string(),
                                q.state ? q.state : "", python_name(q), q.python_also ? q.python_also : ""));
  };
  add(frame_quantities());
  add(touch_quantities());
  return all;
}

}  // namespace

/// Reads from the frame without the interpreter's lock, makes the object, and keeps it from then on.
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

py::object images_of(std::vector<uint8_t> bytes, const FrameFormat& f, py::ssize_t frames) {
  const py::ssize_t width = f.width;
  py::object array = hand_out(std::move(bytes), {frames, f.channels, f.height,
                                                 width * static_cast<py::ssize_t>(f.bytes_per_pixel())});
  if (f.bytes_per_pixel() == 2) array = array.attr("view")("uint16");
  return f.channels == 1 ? array.attr("reshape")(frames, f.height, width)
                         : array.attr("transpose")(0, 2, 3, 1);
}

py::object PyTouch::depth_mm() {
  if (!touch().surface)
    throw Refusal{"SensorError", "depth_mm", "a sensor that measures no surface, or outputs without it",
                  "a sensor file with \"surface\", or outputs=[\"force\", \"surface\"]"};
  return once(
      depth_, "depth_mm",
      [](const Pipeline&, const Result& result, const Frame&) {
        const std::span<const float> depth = result.depth_mm();
        return std::vector<float>(depth.begin(), depth.end());
      },
      [this](std::vector<float> depth) { return hand_out(std::move(depth), shape()); });
}

py::object PyTouch::image() {
  return once(
      image_, "image",
      [](const Pipeline&, const Result&, const Frame& frame) {
        return std::vector<uint8_t>(frame.pixels(), frame.pixels() + frame.format.frame_bytes());
      },
      [this](std::vector<uint8_t> bytes) -> py::object {
        return images_of(std::move(bytes), held_->format(), 1)[py::int_(0)];
      });
}

py::object PyTouch::confidence() {
  if (!touch().confidence)
    throw Refusal{"ArgumentError", "confidence", "outputs without it",
                  "outputs=[\"force\", \"surface\", \"confidence\"]"};
  return once(
      confidence_, "confidence",
      [](const Pipeline&, const Result& result, const Frame&) {
        const std::span<const uint16_t> pixels = result.confidence();
        return std::vector<uint16_t>(pixels.begin(), pixels.end());
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

std::vector<uint8_t> extrapolated_pixels(const ExtrapolatedCells& map, const FrameFormat& format) {
  std::vector<uint8_t> pixels;
  if (map.cells.empty()) return pixels;
  pixels.reserve(size_t{format.width} * format.height);
  for (uint32_t y = 0; y < format.height; ++y)
    for (uint32_t x = 0; x < format.width; ++x)
      pixels.push_back(map.cells[size_t{y / map.cell_px} * map.width + x / map.cell_px]);
  return pixels;
}

py::object PyTouch::extrapolated() {
  if (!touch().surface || !touch().surface->extrapolated_px)
    throw Refusal{
        "SensorError", "extrapolated", "a sensor file that holds no presses of its calibration",
        "a colour gel calibrated by palpate setup, and outputs=[\"force\", \"surface\", \"contacts\"]"};
  return once(
      extrapolated_, "extrapolated",
      [](const Pipeline&, const Result& result, const Frame& frame) {
        return extrapolated_pixels(result.extrapolated, frame.format);
      },
      [this](std::vector<uint8_t> pixels) {
        return hand_out(std::move(pixels), shape()).attr("view")("bool");
      });
}

Kept kept_of(const std::vector<std::string>& names) {
  static const std::map<std::string, bool Kept::*> kMaps = {
      {"depth_mm", &Kept::depth},        {"image", &Kept::image},
      {"confidence", &Kept::confidence}, {"pressure_kPa", &Kept::traction},
      {"shear_kPa", &Kept::traction},    {"extrapolated", &Kept::extrapolated}};
  Kept kept;
  for (const std::string& name : names) kept.*by_name(kMaps, name, "names of maps to keep") = true;
  return kept;
}

void PyTouch::keep(const Kept& kept) {
  if (kept.depth) depth_mm();
  if (kept.image) image();
  if (kept.confidence) confidence();
  if (kept.traction) read_traction("pressure_kPa");
  if (kept.extrapolated) extrapolated();
}

void bind_touch(py::module_& module) {
  bind_contact(module);
  bind_truth(module);
  bind_wrench(module);
  bind_motion(module);
  py::class_<PyTouch> bound(module, "Touch");
  bind_quantities(bound, frame_quantities(), [](const PyTouch& t) {
    return FrameKey{t.touch().sequence, t.touch().time_ns, t.held().file()};
  });
  bind_quantities(bound, touch_quantities(), [](const PyTouch& t) -> const Touch& { return t.touch(); });
  bound.def_property_readonly("time_ns", [](const PyTouch& t) { return t.touch().time_ns; })
      .def_property_readonly("monotonic_s",
                             [](const PyTouch& t) {
                               const int64_t ns = t.held().exposed_ns();
                               return ns ? static_cast<double>(ns) / 1e9 : kNone;
                             })
      .def_property_readonly("contacts", [](const PyTouch& t) { return t.touch().contacts; })
      .def_property_readonly("truth",
                             [](const PyTouch& t) {
                               std::optional<Truth> truth = t.held().truth();
                               return truth ? std::optional<PyTruth>(PyTruth{std::move(*truth)})
                                            : std::nullopt;
                             })
      .def_property_readonly("image", &PyTouch::image)
      .def_property_readonly("confidence", &PyTouch::confidence)
      .def(
          "keep",
          [](py::object self, const py::args& given) {
            std::vector<std::string> names;
            for (const py::handle& name : given) names.push_back(py::str(name));
            if (names.empty()) names = {"depth_mm", "image"};
            self.cast<PyTouch&>().keep(kept_of(names));
            return self;
          },
          "Reads maps now, so that they stay; without names depth and image.  Gives the touch itself.")
      .def("__repr__", &touch_text)
      .def("_repr_html_", &as_html);
  bound.def_property_readonly("depth_mm", &PyTouch::depth_mm)
      .def_property_readonly("skin_points", [](const PyTouch& t) { return skin_points_of(t.touch()); })
      .def_property_readonly("pressure_kPa", &PyTouch::pressure_kPa)
      .def_property_readonly("shear_kPa", &PyTouch::shear_kPa)
      .def_property_readonly("extrapolated", &PyTouch::extrapolated)
      .def_property_readonly("wrench", [](const PyTouch& t) { return PyWrench{t.shared()}; })
      .def_property_readonly("motion", [](const PyTouch& t) { return PyMotion{t.shared()}; });
  module.def("quantities", &quantities);
}

}  // namespace palpate::python

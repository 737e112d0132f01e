#include "engine/grip/grip_quantities.h"

#include "engine/measure/quantity_fields.h"

namespace palpate {
namespace {

using F = GripFrame;
using enum QuantityKind;

constexpr uint32_t kColumn = MeasuredColumns::Frame;

template <auto... Path>
constexpr MeasuredQuantity<F> grip_field(const char* name, const char* unit, int places, const char* sentence,
                                         QuantityDetails<F> details = {}) {
  details.unit = unit;
  details.places = places;
  return {details, name, kColumn, detail::kind_at<F, Path...>(), sentence, value_at<F, Path...>};
}
template <auto Member>
constexpr MeasuredQuantity<F> of_grip(const char* name, const char* unit, int places, const char* sentence,
                                      QuantityDetails<F> details = {}) {
  return grip_field<&F::grip, Member>(name, unit, places, sentence, details);
}

QuantityValue seconds(const F& frame) {
  return 1e-9 * static_cast<double>(frame.time_ns);
}

constexpr MeasuredQuantity<F> kGrip[] = {
    {{.unit = "s", .places = kTimePlaces},
     "time_s",
     kColumn,
     Number,
     "Exposure since the first row, of a pair the middle of both frames.",
     seconds},
    grip_field<&F::left>("left_frame", "", 0, "Number of the left frame; empty: the right one is alone.",
                         {.none = true}),
    grip_field<&F::right>("right_frame", "", 0, "Number of the right frame; empty: the left one is alone.",
                          {.none = true}),
    grip_field<&F::skew_ms>("skew_ms", "ms", kLengthPlaces,
                            "Time of the right frame less that of the left one.", {.row = {"skew", 2, true}}),
    of_grip<&Grip::force_N>("grip_force_N", "N", kForcePlaces, "Mean of both normal forces.",
                            {.state = "grip_force_state", .row = {"grip force", 3}}),
    of_grip<&Grip::imbalance_N>("imbalance_N", "N", kForcePlaces,
                                "Normal force of the right pad less that of the left one.",
                                {.row = {"imbalance", 3, true}}),
    of_grip<&Grip::load_x_N>("load_x_N", "N", kForcePlaces,
                             "Tangential force of the object on both pads, along x of the gripper.",
                             {.row = {"load x, y, z", 2, true}}),
    of_grip<&Grip::load_y_N>("load_y_N", "N", kForcePlaces,
                             "Tangential force of the object on both pads, along y of the gripper.",
                             {.row = {"load x, y, z", 2, true}}),
    of_grip<&Grip::load_z_N>("load_z_N", "N", kForcePlaces,
                             "Tangential force of the object on both pads, along z of the gripper. The state "
                             "is that of all three.",
                             {.state = "load_state", .row = {"load x, y, z", 2, true}}),
    of_grip<&Grip::turn_rad>("turn_rad", "rad", kAnglePlaces,
                             "Turn of the object about the closing direction since both pads touch it, by "
                             "the skin of the pads.",
                             {.state = "turn_state", .row = {"turn", 1, true, "deg", 57.29578}}),
    of_grip<&Grip::slip>("grip_slip", "", kRatioPlaces, "Slip of either finger: the worse of both.",
                         {.none = true, .row = {"stick or slip"}}),
    grip_field<&F::opening_mm>("opening_mm", "mm", kLengthPlaces, "Opening of the gripper, as it was told.",
                               {.row = {"opening", 2}}),
    of_grip<&Grip::thickness_mm>("thickness_mm", "mm", kLengthPlaces,
                                 "What is held, between the deepest points of both dents.",
                                 {.state = "thickness_state", .row = {"thickness", 3}}),
    of_grip<&Grip::stiffness_N_per_mm>("stiffness_N_per_mm", "N/mm", kForcePlaces,
                                       "Force over thickness lost, by a line through the grip so far.",
                                       {.error = "stiffness_sd_N_per_mm", .row = {"stiffness", 3}}),
    of_grip<&Grip::stiffness>("stiffness_state", "", kRatioPlaces,
                              "`known`, `force in doubt` (not valid, as its state says), `not gripped`, "
                              "`thickness not known` or `not "
                              "identifiable`: the object gave way by too little for the errors stated.",
                              {.none = true}),
};

}  // namespace

std::span<const MeasuredQuantity<GripFrame>> grip_quantities() {
  return kGrip;
}

}  // namespace palpate

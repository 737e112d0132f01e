#include "capture/files/true_quantities.h"

#include "engine/measure/quantity_fields.h"

namespace palpate {
namespace {

constexpr auto kTruthColumns = MeasuredColumns::Truth;

template <auto Field>
QuantityValue field(const TrueFrame& frame) {
  return value_at<Truth, Field>(*frame.truth);
}
bool touched(const TrueFrame& frame) {
  return frame.truth->contact;
}
// A scene with one contact may leave the list to its single fields.
QuantityValue contacts_of(const TrueFrame& frame) {
  const Truth& truth = *frame.truth;
  return uint64_t{truth.contacts.empty() ? (truth.contact ? 1u : 0u) : truth.contacts.size()};
}

using Details = QuantityDetails<TrueFrame>;

constexpr MeasuredQuantity<TrueFrame> number(const char* name, const char* unit, const char* sentence,
                                             QuantityValue (*value)(const TrueFrame&), Details details) {
  details.unit = unit;
  if (details.places == kByUnit) details.places = kAllPlaces;
  return {details, name, kTruthColumns, QuantityKind::Number, sentence, value};
}

constexpr MeasuredQuantity<TrueFrame> kTrue[] = {
    {Details{.unit = "", .python = "contact"}, "true_contact", kTruthColumns, QuantityKind::Flag,
     "Whether something touches the pad.", field<&Truth::contact>},
    number("true_force_N", "N", "Normal force on the pad.", field<&Truth::force_N>, {.python = "force_N"}),
    number("true_shear_x_N", "N", "Tangential force to the right, friction limited.",
           field<&Truth::shear_x_N>, {.python = "shear_x_N"}),
    number("true_shear_y_N", "N", "Tangential force downwards.", field<&Truth::shear_y_N>,
           {.python = "shear_y_N"}),
    {Details{.unit = "", .python = "slipping"}, "true_slip", kTruthColumns, QuantityKind::Flag,
     "Whether the contact slides.", field<&Truth::slipping>},
    number("true_center_x_px", "px", "Centre of the contact, x to the right.", field<&Truth::center_x_px>,
           {.in_table = touched, .python = "center_x_px"}),
    number("true_center_y_px", "px", "Centre of the contact, y downwards.", field<&Truth::center_y_px>,
           {.in_table = touched, .python = "center_y_px"}),
    number("true_radius_px", "px", "Radius of the contact.", field<&Truth::radius_px>,
           {.python = "radius_px"}),
    number("true_depth_max_mm", "mm", "Depth of the deepest point below the rest level.",
           field<&Truth::indentation_mm>, {.python = "depth_max_mm"}),
    number("depth_rms_error_mm", "mm", "RMS difference between the measured and the true depth map.",
           value_at<TrueFrame, &TrueFrame::depth_rms_error_mm>,
           {.places = kRatioPlaces, .python = "", .why = "a stream compares no maps"}),
    {Details{.unit = "", .python = "", .why = "Python has the touch's contacts only"}, "true_contacts",
     kTruthColumns, QuantityKind::Whole, "Number of separate contacts.", contacts_of},
    number("true_volume_mm3", "mm3", "Indented volume below the rest level.", field<&Truth::volume_mm3>,
           {.python = "volume_mm3"}),
    number("true_torsion_rad", "rad", "Turn of the skin under the contact, from +x towards +y.",
           field<&Truth::torsion_rad>, {.python = "torsion_rad"}),
    number("true_stick_share", "", "Radius of the part that sticks over the contact's; 0: it slides.",
           field<&Truth::stick_share>,
           {.in_table = touched, .python = "stick_share", .python_also = "stick_fraction"}),
};

}  // namespace

std::span<const MeasuredQuantity<TrueFrame>> true_quantities() {
  return kTrue;
}

}  // namespace palpate

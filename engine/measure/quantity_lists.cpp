// The lists of quantities.
#include <array>
#include <initializer_list>
#include <limits>
#include <vector>

#include "engine/measure/quantity_fields.h"

namespace palpate {
namespace {

using G = MeasuredColumns;
using enum QuantityKind;

constexpr const char* kElsewhere = "it stands in a row of another quantity";
constexpr uint32_t kNoColumn = 0;

struct UnitOf {
  const char* ending;
  const char* unit;
  int places;
};
// The longer ending first; without one a ratio.
constexpr UnitOf kUnits[] = {
    {"_Nmm", "N mm", kForcePlaces}, {"_N", "N", kForcePlaces},    {"_mm2", "mm2", kLengthPlaces},
    {"_mm3", "mm3", kLengthPlaces}, {"_mm", "mm", kLengthPlaces}, {"_px", "px", kPixelPlaces},
    {"_rad", "rad", kAnglePlaces},  {"_kPa", "kPa", kGrayPlaces}, {"_gray", "gray levels", kGrayPlaces},
    {"_s", "s", kTimePlaces},       {"", "", kRatioPlaces}};

/// An entry whose value `value` finds.
template <typename Of>
constexpr MeasuredQuantity<Of> made(const char* name, uint32_t group, QuantityKind kind, const char* sentence,
                                    QuantityValue (*value)(const Of&), QuantityDetails<Of> details = {}) {
  const UnitOf* of = kUnits;
  while (!std::string_view(name).ends_with(of->ending)) ++of;
  if (!details.unit) details.unit = of->unit;
  if (details.places == kByUnit) details.places = of->places;
  return {details, name, group, kind, sentence, value};
}

/// An entry that is a field, found by a path of members.
template <typename Of, auto... Path>
constexpr MeasuredQuantity<Of> field(const char* name, uint32_t group, const char* sentence,
                                     QuantityDetails<Of> details = {}) {
  return made<Of>(name, group, detail::kind_at<Of, Path...>(), sentence, value_at<Of, Path...>, details);
}

// A frame's own numbers are those of a whole picture, and where several touch each contact has its place.
bool seen(const Touch& touch) {
  return touch.picture == PictureFault::None;
}
bool seen(const ContactTouch&) {
  return true;
}
bool alone(const Touch& touch) {
  return touch.contact && touch.contacts.size() < 2;
}
bool alone(const ContactTouch&) {
  return true;
}

template <typename S>
constexpr std::array<MeasuredQuantity<S>, 20> kShape = {{
    field<S, &S::gray_sum>("gray_sum", G::Touching,
                           "G: sum of the filtered change from the background over the contact.",
                           {.unit = "gray levels", .places = kSumPlaces, .row = {"sum, peak", 0}}),
    field<S, &S::force_N>(
        "force_N", G::Force,
        "Normal force; with several contacts the sum of theirs. State: valid, not calibrated, calibration "
        "not fit for use, other shapes not judged, no contact, picture damaged, below or above calibrated "
        "range, reaches the border (what presses outside the frame is missing), saturated, light unknown.",
        {.state = "force_state", .why = "it is the headline"}),
    field<S, &S::centroid_x_px>(
        "centroid_x_px", G::Touching,
        "Gray-weighted centre, x to the right; (0, 0) is the centre of the top left pixel.",
        {.in_table = alone, .row = {"centroid", 2}}),
    field<S, &S::centroid_y_px>("centroid_y_px", G::Touching, "Gray-weighted centre, y downwards.",
                                {.in_table = alone, .row = {"centroid", 2}}),
    field<S, &S::area_px>("area_px", G::Touching,
                          "Area in contact; of a colour gel with a surface what lies deeper than where the "
                          "sides of its dent are steepest, without a surface its outline in the picture.",
                          {.in_table = seen, .row = {"area in contact"}}),
    field<S, &S::area_mm2>("area_mm2", G::Millimetres, "Area in contact, as `area_px`.",
                           {.row = {"area in contact", 2}}),
    field<S, &S::ellipse, &Ellipse::major_mm>(
        "ellipse_major_mm", G::Millimetres, "Full major axis of the ellipse with the area's second moments.",
        {.in_table = alone, .row = {"ellipse", 2}}),
    field<S, &S::ellipse, &Ellipse::major_px>("ellipse_major_px", G::Pixels,
                                              "Full major axis; a column where no scale is known.",
                                              {.in_table = alone, .row = {"ellipse", 1}}),
    field<S, &S::ellipse, &Ellipse::minor_mm>(
        "ellipse_minor_mm", G::Millimetres, "Full minor axis of the ellipse with the area's second moments.",
        {.in_table = alone, .row = {"ellipse", 2}}),
    field<S, &S::ellipse, &Ellipse::minor_px>("ellipse_minor_px", G::Pixels,
                                              "Full minor axis; a column where no scale is known.",
                                              {.in_table = alone, .row = {"ellipse", 1}}),
    field<S, &S::ellipse, &Ellipse::angle_rad>(
        "ellipse_angle_rad", G::Touching, "Angle of the major axis from +x towards +y, in (-pi/2, pi/2].",
        {.in_table = alone, .why = "the panel shows the axes alone"}),
    field<S, &S::peak_gray>("peak_gray", G::Touching, "Largest filtered change.", {.row = {"sum, peak", 1}}),
    field<S, &S::saturated_px>(
        "saturated_px", G::Touching,
        "Raw pixels that touch has brought to the camera's limit, in the whole frame; of a contact its own.",
        {.in_table = seen, .row = {"saturated"}}),
    field<S, &S::shear_x_N>("shear_x_N", G::Shear,
                            "Tangential force to the right, at most friction times normal force.",
                            {.row = {"shear x", 3, true}}),
    field<S, &S::shear_y_N>(
        "shear_y_N", G::Shear,
        "Tangential force downwards. The state of both is \"onset unseen\" where the contact began while no "
        "frames came, and shear counts from there; \"reaches the border\" while the contact does or did at "
        "its onset, since its centroid lies elsewhere.",
        {.state = "shear_state", .row = {"shear y", 3, true}}),
    field<S, &S::shift_x_mm>(
        "shift_x_mm", G::ShiftMillimetres,
        "How far the centroid moved to the right since the contact's onset; not known of separate pictures.",
        {.in_table = alone, .row = {"moved", 3, true}}),
    field<S, &S::shift_x_px>("shift_x_px", G::ShiftPixels,
                             "How far it moved to the right; a column where no scale is known.",
                             {.in_table = alone, .row = {"moved", 1, true}}),
    field<S, &S::shift_y_mm>(
        "shift_y_mm", G::ShiftMillimetres,
        "How far the centroid moved downwards since the contact's onset; not known of separate pictures.",
        {.in_table = alone, .row = {"moved", 3, true}}),
    field<S, &S::shift_y_px>("shift_y_px", G::ShiftPixels,
                             "How far it moved downwards; a column where no scale is known.",
                             {.in_table = alone, .row = {"moved", 1, true}}),
    field<S, &S::slip>("slip", G::Slipping,
                       "Stick or slip: `stick`, `incipient slip`, `slip`, `no contact` or `not calibrated`; "
                       "see engine/measure/README.md.",
                       {.row = {"stick or slip"}}),
}};

constexpr MeasuredQuantity<FrameKey> kFrame[] = {
    field<FrameKey, &FrameKey::sequence>("frame", G::Frame,
                                         "Number of the frame from 0; a gap is a lost frame.",
                                         {.python = "sequence", .why = "the status line shows it"}),
    made<FrameKey>(
        "time_s", G::Time, Number,
        "Time of exposure since the source began, on its own clock; of images only with a rate.",
        [](const FrameKey& key) -> QuantityValue { return static_cast<double>(key.time_ns) / 1e9; },
        {.why = "the status line shows it"}),
    made<FrameKey>("source", G::Source, Word,
                   "The picture's file, without its folder; only of folders and lists of images, whose order "
                   "is that of their names, with runs of digits and decimals as numbers.",
                   [](const FrameKey& key) -> QuantityValue {
                     return key.source.empty() ? QuantityValue{} : key.source;
                   },
                   {.none = true, .why = "the status line shows it"}),
};

constexpr MeasuredQuantity<Touch> kContact =
    field<Touch, &Touch::contact>("contact", G::Touching, "Whether some pixel reached the threshold.",
                                  {.in_table = seen, .why = "the headline says it"});

// Where a touch is judged; with several contacts each is judged by its own skin.
QuantityValue slip_by(const Touch& touch) {
  const bool judged = touch.slip == Slip::Stick || touch.slip == Slip::Incipient || touch.slip == Slip::Slip;
  return judged ? QuantityValue{std::string_view(touch.skin ? "skin" : "limit")} : QuantityValue{};
}

QuantityValue depth_of(const Touch& touch) {
  if (!touch.surface) return {};
  const SurfaceSummary& surface = *touch.surface;
  const double sd_mm = surface.depth_sd_mm;
  return Estimate{surface.depth_max_mm, sd_mm > 0 ? sd_mm : std::numeric_limits<double>::quiet_NaN(),
                  surface.validity};
}

QuantityValue reference_of(const Touch& touch) {
  if (!touch.surface) return {};
  return std::string_view(touch.surface->rest_from_untouched ? "rest" : "mean");
}

// With more regions than there was room for, the number of contacts is not known.
QuantityValue contacts_of(const Touch& touch) {
  if (!touch.regions || touch.regions->overflow) return {};
  return uint64_t{touch.contacts.size()};
}

constexpr MeasuredQuantity<Touch> kSurface[] = {
    made<Touch>("slip_by", G::Slipping, Word,
                "What shows the slip of a single contact: `skin`, whose pattern stays behind what slides and "
                "goes along with what rolls, or `limit`: the contact's own motion at the friction limit, so "
                "that one that rolls is taken for one that slides.",
                slip_by, {.in_table = alone, .none = true, .why = "the sensor's panel says it"}),
    made<Touch>(
        "depth_max_mm", G::Depth, Estimated,
        "Deepest point, where there is contact and along the border; its error where the sensor file states "
        "one (of colour gels by the presses that calibration left out, each depth of a contact having it "
        "too). The state is that of the whole depth map: valid, no contact, saturated, reaches the border "
        "(reading `elastic`: what presses outside the frame is missing) or slopes clipped, which make depths "
        "lower bounds; too deep for the pad (of known thickness); covered where printed markers hide more "
        "than a hundredth of a gel's frame, with "
        "nothing next to them to continue from; extrapolated as `extrapolated_px`; light unknown as "
        "`light_state`, or where what changed smoothly around a contact of a colour gel may be light or pad: "
        "then neither depth nor what follows from it, nor that nothing touches, is known.",
        depth_of,
        {.state = "depth_state",
         .error = "depth_sd_mm",
         .error_group = G::DepthError,
         .every_state = true,
         .row = {"deepest", 3}}),
    made<Touch>("depth_reference", G::Depth, Word,
                "Depth 0 is the untouched part of the frame (`rest`; with reading `elastic` the pad far "
                "away) or, without one, the frame's mean (`mean`).",
                reference_of, {.in_table = seen, .none = true, .why = kElsewhere}),
    field<Touch, &Touch::confidence, &ConfidenceSummary::unknown_px>(
        "unknown_px", G::Confidence, "Pixels of which nothing is known.", {.none = true, .row = {"unknown"}}),
    field<Touch, &Touch::confidence, &ConfidenceSummary::shadowed_px>(
        "shadowed_px", G::Confidence, "Pixels too dark to carry a slope, wholly or in part.",
        {.none = true, .why = "the panel shows the unknown pixels"}),
    field<Touch, &Touch::confidence, &ConfidenceSummary::outside_px>(
        "outside_px", G::Confidence, "Pixels beyond the pad's outline.",
        {.none = true, .why = "the panel shows the unknown pixels"}),
    field<Touch, &Touch::surface, &SurfaceSummary::weighted, &WeightedSummary::islands>(
        "islands", G::Weighted,
        "Parts of the frame that nothing known joins: heights between them are not determined, and "
        "`depth_state` is `apart` where they are touched. This and the next two are of frames with other "
        "unknown pixels than those that no frame shows (beyond the pad's outline, specks), or with pixels "
        "known in part.",
        {.none = true, .row = {.label = "islands", .only_if_some = true}}),
    field<Touch, &Touch::surface, &SurfaceSummary::weighted, &WeightedSummary::residual>(
        "weighted_residual", G::Weighted, "Relative RMS that the solve leaves of its equations.",
        {.why = "the state of the depth says where it matters"}),
    field<Touch, &Touch::surface, &SurfaceSummary::weighted, &WeightedSummary::unexplained>(
        "weighted_misfit", G::Weighted, "Fraction of the weighted slopes that no surface explains, 0 to 1.",
        {.why = "the state of the depth says where it matters"}),
    field<Touch, &Touch::surface, &SurfaceSummary::clipped_px>(
        "clipped_px", G::Depth,
        "Pixels steeper than `surface.max_slope`, clipped to it; `depth_state` says so from 1 % of the "
        "contact's area on, with reading `shading` beyond a rim of 4 px, which the filter always leaves "
        "dark.",
        {.in_table = seen, .none = true, .row = {.label = "clipped slopes", .only_if_some = true}}),
    made<Touch>("contacts", G::Contacts, Whole,
                "Number of separate contacts; empty where there are more regions than there is room for.",
                contacts_of, {.python = "", .row = {"contacts"}, .why = "`contacts` lists them"}),
    made<Touch>("contacts_overflow", kNoColumn, Flag,
                "More regions than there was room for: contacts are incomplete.",
                [](const Touch& touch) -> QuantityValue { return touch.regions && touch.regions->overflow; },
                {.row = {.label = "more than listed", .only_if_some = true}, .why = "`contacts` is empty"}),
    field<Touch, &Touch::surface, &SurfaceSummary::volume_mm3>(
        "volume_mm3", G::Depth, "Indented volume below the rest level, of touched tiles.",
        {.row = {.label = "volume", .places = 2, .only_if_some = true}}),
    field<Touch, &Touch::surface, &SurfaceSummary::dented_mm2>(
        "dented_mm2", G::Dented,
        "Area dented, of colour gels: what lies deeper than a tenth of the deepest point and than the noise "
        "at rest; wider than the area in contact, since the pad goes down next to the object too.",
        {.row = {"area dented", 2}}),
    field<Touch, &Touch::surface, &SurfaceSummary::extrapolated_px>(
        "extrapolated_px", G::Extrapolated,
        "Dented pixels at places, or of colours, that the presses of the calibration did not have; "
        "`depth_state` is `extrapolated` from a quarter of those dented on. Of colour gels whose sensor file "
        "says what calibration saw.",
        {.row = {.label = "extrapolated", .only_if_some = true}}),
};

constexpr MeasuredQuantity<Touch> kSkinAndLight[] = {
    field<Touch, &Touch::skin, &SkinMotion::points>(
        "skin_points", G::Skin, "Places of the skin's pattern that are followed.",
        {.python = "", .row = {"skin points"}, .why = "`skin_points` lists them"}),
    field<Touch, &Touch::skin, &SkinMotion::lost>(
        "skin_lost", G::Skin, "Places of the skin's pattern that are lost.",
        {.none = true, .row = {.label = "skin points lost", .only_if_some = true}}),
    field<Touch, &Touch::skin, &SkinMotion::shift_x_mm>(
        "skin_shift_x_mm", G::Skin,
        "How far the skin under the contact's core moved to the right since the contact's onset.",
        {.row = {"skin moved", 3, true}}),
    field<Touch, &Touch::skin, &SkinMotion::shift_y_mm>(
        "skin_shift_y_mm", G::Skin,
        "How far the skin under the contact's core moved downwards since the contact's onset.",
        {.row = {"skin moved", 3, true}}),
    field<Touch, &Touch::skin, &SkinMotion::torsion_rad>(
        "torsion_rad", G::Skin,
        "Turn of the skin about the normal since the contact's onset, from +x towards +y.",
        {.row = {"torsion", 2, true, "deg", 57.29578}}),
    field<Touch, &Touch::skin, &SkinMotion::stick_share>(
        "stick_share", G::Skin,
        "Radius of the part of the contact that still sticks over the contact's, 0 to 1.",
        {.places = kAnglePlaces,
         .python_also = "stick_fraction",
         .row = {"stick share", 0, false, "% of radius", 100}}),
    field<Touch, &Touch::gradient_sum>(
        "gradient_sum", G::Gradient,
        "How much steeper than `contact.gradient_gray_per_px` the change varies from pixel to pixel, summed "
        "over the frame's pixels; also where the force is read from it.",
        {.unit = "gray levels px",
         .places = kSumPlaces,
         .none = true,
         .why = "the force that is read from it is the headline"}),
    field<Touch, &Touch::light, &LightSummary::state>(
        "light_state", G::Light,
        "Of colour gels: `steady`, `changed` (exposure, white balance or lamps that changed by themselves "
        "were taken out) or `unknown` (too little of the frame is as in the untouched image, since touch "
        "covers it or another unit took that image: the light of the frame before was taken, of separate "
        "pictures none; or printed markers are under another light, by a twentieth of a colour's mean or "
        "more).",
        {.none = true, .row = {.label = "light", .only_if_some = true}}),
    field<Touch, &Touch::light, &LightSummary::change_gray>(
        "light_change_gray", G::Light,
        "RMS over the frame of what was taken out, of the colour that changed most.",
        {.row = {.label = "light changed by", .places = 1, .only_if_some = true}}),
};

bool pressed(const Touch& touch) {
  return touch.traction && has_value(touch.traction->fz_N);
}
bool sheared(const Touch& touch) {
  return pressed(touch) && has_value(touch.traction->fx_N);
}
/// A number of a traction that presses.
template <double TractionSummary::*Field>
QuantityValue pressing(const Touch& touch) {
  return pressed(touch) ? QuantityValue{(*touch.traction).*Field} : QuantityValue{};
}

/// A component of the wrench, by its name within it and its older one.
template <Estimate TractionSummary::*Field>
constexpr MeasuredQuantity<Touch> component(const char* name, const char* older, const char* sentence) {
  const bool force = std::string_view(name).ends_with("_N");
  return field<Touch, &Touch::traction, Field>(
      name, G::Traction, sentence, {.python_also = older, .row = {force ? "fx, fy, fz" : "mx, my, mz", 2}});
}

constexpr MeasuredQuantity<Touch> kTraction[] = {
    component<&TractionSummary::fx_N>(
        "wrench_fx_N", "wrench.force_x_N",
        "Force on the pad by its elastic layer, to the right; where the skin is followed."),
    component<&TractionSummary::fy_N>(
        "wrench_fy_N", "wrench.force_y_N",
        "Force on the pad by its elastic layer, downwards; where the skin is followed."),
    component<&TractionSummary::fz_N>(
        "wrench_fz_N", "wrench.force_z_N",
        "Force on the pad by its elastic layer, into the pad; of a contact that reaches the "
        "border with what is taken to press beyond it."),
    component<&TractionSummary::mx_Nmm>(
        "wrench_mx_Nmm", "wrench.moment_x_Nmm",
        "Moment of that force about the axis to the right through the frame's middle."),
    component<&TractionSummary::my_Nmm>("wrench_my_Nmm", "wrench.moment_y_Nmm",
                                        "Its moment about the axis downwards through the frame's middle."),
    component<&TractionSummary::mz_Nmm>(
        "wrench_mz_Nmm", "wrench.moment_z_Nmm",
        "Its moment about the normal in the frame's middle; where the skin is followed."),
    field<Touch, &Touch::traction, &TractionSummary::fz_N, &Estimate::validity>(
        "wrench_state", G::Traction, "State of `wrench_fz_N`.",
        {.python = "",
         .row = {.label = "wrench", .only_if_some = true},
         .why = "each component has its own state"}),
    made<Touch>("pressure_max_kPa", G::Traction, Number, "Largest pressure on the layer.",
                pressing<&TractionSummary::pressure_max_kPa>,
                {.python = "wrench.pressure_max_kPa", .row = {"largest pressure", 1}}),
    made<Touch>("shear_max_kPa", G::Traction, Number,
                "Largest shear on the layer, where the skin is followed.",
                [](const Touch& touch) -> QuantityValue {
                  return sheared(touch) ? QuantityValue{touch.traction->shear_max_kPa} : QuantityValue{};
                },
                {.python = "wrench.shear_max_kPa", .row = {"largest shear", 1}}),
    made<Touch>("pressed_area_mm2", G::Traction, Number, "Area that carries pressure.",
                pressing<&TractionSummary::area_mm2>,
                {.places = kGrayPlaces,
                 .python = "wrench.pressed_area_mm2",
                 .python_also = "wrench.area_mm2",
                 .row = {"pressed area", 1}}),
    made<Touch>("unexplained_slope", G::Traction, Number,
                "RMS of the surface's slopes that no pressure on the layer explains.",
                [](const Touch& touch) -> QuantityValue {
                  const bool solved = pressed(touch) && touch.traction->unexplained_slope > 0;
                  return solved ? QuantityValue{touch.traction->unexplained_slope} : QuantityValue{};
                },
                {.places = kLengthPlaces,
                 .python = "wrench.unexplained_slope",
                 .why = "the wrench's state says where it matters"}),
    field<Touch, &Touch::traction, &TractionSummary::bending_mm>(
        "bending_mm", G::Traction,
        "How steeply the change of a colour gel, relative to the untouched image and smoothed over a quarter "
        "of the pad's thickness, varies, integrated over the frame; where a force is read from it as well.",
        {.python = "wrench.bending_mm", .why = "the force that is read from it is the headline"}),
    field<Touch, &Touch::traction, &TractionSummary::slipping_fraction>(
        "slipping_fraction", kNoColumn, "Fraction of the cells with pressure that are at the friction limit.",
        {.python = "wrench.slipping_fraction",
         .none = true,
         .row = {"at friction limit", 0, false, "% of the area", 100},
         .why = "--traction writes the ratio of each cell"}),
};

/// A component of the object's pose.
template <std::array<Estimate, 3> ObjectPose::*Of, size_t K>
QuantityValue pose_component(const Touch& touch) {
  return touch.object ? QuantityValue{((*touch.object).*Of)[K]} : QuantityValue{};
}
template <size_t K>
QuantityValue contact_middle(const Touch& touch) {
  return touch.object ? QuantityValue{touch.object->at_mm[K]} : QuantityValue{};
}

QuantityValue object_on_skin(const Touch& touch) {
  if (!touch.object || touch.object->on_skin == OnSkin::Unknown) return {};
  return std::string_view(to_string(touch.object->on_skin));
}
template <size_t K>
QuantityValue slip_component(const Touch& touch) {
  if (!touch.object || touch.object->on_skin == OnSkin::Unknown) return {};
  return touch.object->slip_mm[K];
}

constexpr MeasuredQuantity<Touch> kObject[] = {
    field<Touch, &Touch::object, &ObjectPose::state>(
        "object_state", G::Object,
        "Whether the object that touches the pad is followed: `begun` (a track's first frame), `tracked`, "
        "`lost`, "
        "`no contact` or `picture damaged`. After a loss the next frame begins a new track.",
        {.none = true, .row = {"object"}}),
    field<Touch, &Touch::object, &ObjectPose::loss>(
        "object_loss", G::Object,
        "Why it was lost: `little overlap` with the key frame, `large residual`, `many strangers` (pixels "
        "that do "
        "not fit), `large step` (by a third of the contact in one frame), `slopes disagree` (another wave of "
        "a texture may "
        "have been found); else `none`.",
        {.none = true, .why = "the state says that it was lost"}),
    field<Touch, &Touch::object, &ObjectPose::doubt>(
        "object_doubt", G::Object,
        "What the pose is to be taken with care for: `others move` (several contacts that move unlike: it is "
        "the "
        "largest one's), `shape changes` (what is left over is no rigid object's), `fits elsewhere` (the "
        "surface "
        "repeats, and fits as well a wave farther) or `none`.",
        {.none = true, .row = {.label = "object in doubt", .only_if_some = true}}),
    field<Touch, &Touch::object, &ObjectPose::track>(
        "object_track", G::Object, "Number of the track, from 1; motions count from its first frame.",
        {.none = true, .why = "a new track begins at 0"}),
    field<Touch, &Touch::object, &ObjectPose::surface>(
        "object_surface", G::Object,
        "What of the motion this contact does not determine: `none`, or the shape that slides along itself "
        "unseen "
        "(`ball`: its turns; `plane`: shifts along it and the turn about its normal; `cylinder`, "
        "`revolution`, "
        "`extrusion`, `screw`, `other`). Components that it touches have no number.",
        {.none = true, .row = {.label = "not determined, as of a", .only_if_some = true}}),
    made<Touch>(
        "object_x_mm", G::Object, Number,
        "Middle of the contact that is followed, to the right of the picture's middle; the motions are of "
        "the object's point that is there now.",
        contact_middle<0>, {.why = "the picture shows it"}),
    made<Touch>("object_y_mm", G::Object, Number, "The same, downwards.", contact_middle<1>,
                {.why = "the picture shows it"}),
    made<Touch>("object_z_mm", G::Object, Number, "The same, into the pad.", contact_middle<2>,
                {.why = "the picture shows it"}),
    made<Touch>("object_shift_x_mm", G::Object, Estimated,
                "How far that point of the object has moved to the right since the track began.",
                pose_component<&ObjectPose::shift_mm, 0>, {.row = {"object moved", 3, true}}),
    made<Touch>("object_shift_y_mm", G::Object, Estimated, "The same, downwards.",
                pose_component<&ObjectPose::shift_mm, 1>, {.row = {"object moved", 3, true}}),
    made<Touch>("object_shift_z_mm", G::Object, Estimated, "The same, into the pad.",
                pose_component<&ObjectPose::shift_mm, 2>, {.row = {"object moved", 3, true}}),
    made<Touch>("object_turn_x_rad", G::Object, Estimated,
                "How far the object has turned since then about the axis to the right: a component of its "
                "rotation vector.",
                pose_component<&ObjectPose::turn_rad, 0>,
                {.row = {"object turned", 2, true, "deg", 57.29578}}),
    made<Touch>("object_turn_y_rad", G::Object, Estimated, "The same, about the axis downwards.",
                pose_component<&ObjectPose::turn_rad, 1>,
                {.row = {"object turned", 2, true, "deg", 57.29578}}),
    made<Touch>("object_turn_z_rad", G::Object, Estimated, "The same, about the normal, from +x towards +y.",
                pose_component<&ObjectPose::turn_rad, 2>,
                {.row = {"object turned", 2, true, "deg", 57.29578}}),
    made<Touch>(
        "object_on_skin", G::Object, Word,
        "The object and the skin, where it is followed, by how far both have moved since they last stuck: "
        "`sticks`, `slips` (the object goes on where the skin stays behind) or `disagrees` (the skin goes "
        "farther than the object, or across: one of both is wrong).",
        object_on_skin, {.none = true, .row = {"object on the skin"}}),
    made<Touch>("object_slip_x_mm", G::Object, Estimated,
                "How far the object has slid to the right over the skin since they last stuck.",
                slip_component<0>, {.row = {"slid over the skin", 3, true}}),
    made<Touch>("object_slip_y_mm", G::Object, Estimated, "The same, downwards.", slip_component<1>,
                {.row = {"slid over the skin", 3, true}}),
    field<Touch, &Touch::object, &ObjectPose::residual_mm>(
        "object_residual_mm", G::Object,
        "Difference that the motion leaves between both surfaces, a standard deviation.",
        {.why = "the state says where it matters"}),
    field<Touch, &Touch::object, &ObjectPose::overlap>(
        "object_overlap", G::Object, "Part of the contact that the key frame shares, 0 to 1.",
        {.why = "the state says where it matters"}),
};

// Quantities with a special form in a table's row.
constexpr MeasuredQuantity<Touch> kOfFrame[] = {
    field<Touch, &Touch::at_border>("at_border", kNoColumn,
                                    "Reaches the frame's border: what presses beyond it is missing.",
                                    {.why = "the states of force, shear and depth say it"}),
    field<Touch, &Touch::picture>(
        "picture", kNoColumn,
        "`whole`, or what is wrong with a picture that was spoilt on its way: nothing else is then known.",
        {.why = "each state says it, and summary.json counts them"}),
    field<Touch, &Touch::repeated>("repeated", kNoColumn, "Equal to the frame before in every pixel.",
                                   {.why = "summary.json counts them"}),
};

constexpr MeasuredQuantity<ContactTouch> kContactKey[] = {
    field<ContactTouch, &ContactTouch::id>("id", G::Frame,
                                           "From 1, in order of appearance; never used again."),
    field<ContactTouch, &ContactTouch::frames>("frames", G::Frame,
                                               "Frames since its onset, this one included."),
};

template <uint32_t PixelRect::*Side>
constexpr MeasuredQuantity<ContactTouch> side(const char* name) {
  return field<ContactTouch, &ContactTouch::box, Side>(name, G::Frame, "Of the rectangle around its pixels.",
                                                       {.python = "", .why = "`box_px` holds all four"});
}
constexpr MeasuredQuantity<ContactTouch> kContactPlace[] = {
    field<ContactTouch, &ContactTouch::at_border>(
        "at_border", G::Frame, "Reaches the frame's border: what presses beyond it is missing."),
    side<&PixelRect::x>("box_x_px"),
    side<&PixelRect::y>("box_y_px"),
    side<&PixelRect::width>("box_width_px"),
    side<&PixelRect::height>("box_height_px"),
};

template <typename Of>
std::vector<MeasuredQuantity<Of>> joined(std::initializer_list<std::span<const MeasuredQuantity<Of>>> parts) {
  std::vector<MeasuredQuantity<Of>> all;
  for (const auto part : parts) all.insert(all.end(), part.begin(), part.end());
  return all;
}

}  // namespace

std::span<const MeasuredQuantity<FrameKey>> frame_quantities() {
  return kFrame;
}

std::span<const MeasuredQuantity<Touch>> touch_quantities() {
  static const std::vector<MeasuredQuantity<Touch>> all =
      joined<Touch>({{&kContact, 1}, kShape<Touch>, kSurface, kSkinAndLight, kTraction, kObject, kOfFrame});
  return all;
}

std::span<const MeasuredQuantity<Touch>> shape_quantities() {
  return kShape<Touch>;
}

std::span<const MeasuredQuantity<ContactTouch>> contact_quantities() {
  static const std::vector<MeasuredQuantity<ContactTouch>> all =
      joined<ContactTouch>({kContactKey, kShape<ContactTouch>, kContactPlace});
  return all;
}

std::span<const MeasuredQuantity<Touch>> wrench_quantities() {
  return std::span(kTraction).first(6);
}

}  // namespace palpate

// Light of a lamp at the edge of a waveguide: how much enters, how much stays in, how often it
// meets the touched face, and how much of it a contact there lets out.
//
// The lamp shines straight at the flat end of one layer, as cos^order of the angle from the edge's normal
// (order 1 is Lambert's law) up to a largest angle. Light enters by Snell and Fresnel, unpolarised, and
// spreads freely along the guide; layers are clear. Light is not followed back from the far edge, and a
// contact is so small that it meets undiminished light.
#pragma once

#include <numbers>

#include "engine/optics/fresnel.h"
#include "engine/optics/waveguide.h"

namespace palpate::optics {

struct EdgeLamp {
  size_t layer = 0;       ///< whose end it shines at, from the touched face
  double edge_index = 1;  ///< of what lies between lamp and layer: 1 air, the layer's own if glued in
  double order = 1;       ///< 1 to 1000
  double half_angle_rad = std::numbers::pi / 2;  ///< up to pi/2
};
/// Throws Error(Failure::Input) on a guide or lamp out of range.
void check_lamp(const Waveguide& guide, const EdgeLamp& lamp);
/// The order of a lamp whose data sheet gives the angle from its axis at which half the intensity is left:
/// ln(1/2) / ln(cos(angle)). Throws Error(Failure::Input) outside (0, 60 deg]: 60 deg is Lambert's law.
double order_from_half_intensity(double angle_rad);

/// Fractions of the lamp's light.
struct LampFractions {
  double entering = 0;  ///< the rest is reflected at the edge
  double guided = 0;    ///< stays in until something touches
  double touching = 0;  ///< guided, and meets the touched face
  /// Meetings of guided light with the touched face: the lamp's shares that arrive there per mm of the
  /// guide's length. Over a guide of width w, irradiance is the lamp's power times this over w.
  double arriving_per_mm = 0;
};
/// Throws Error(Failure::Input) on a guide or lamp out of range.
LampFractions lamp_fractions(const Waveguide& guide, const EdgeLamp& lamp);

/// Medium on the touched face.
struct FaceContact {
  OpticalIndex index = {1.4, 0};
  double gap_nm = 0;  ///< of the outside's medium left between; light tunnels through less than a wavelength
  double wavelength_nm = 630;  ///< matters with a gap only
};
/// Share of light at that tangential index that the contact takes, unpolarised.
double contact_transmittance(const Waveguide& guide, const FaceContact& contact, double tangential_index);

struct ContactLight {
  double leaving_per_mm =
      0;  ///< the lamp's share that goes into the contact per mm of its length along the guide
  double per_meeting = 0;  ///< of the guided light that arrives, the share that leaves
  double reached_to = 0;   ///< tangential indices from the guide's lowest up to this one leave in part
};
ContactLight contact_light(const Waveguide& guide, const EdgeLamp& lamp, const FaceContact& contact);

/// Gray value of a contact from that of a reference at the same place, lamp and exposure: in proportion to
/// the light that leaves into it and to the fraction of that which the object sends back (`albedo`, 0 to 1).
struct PredictedGray {
  double gray = 0;       ///< change from the untouched image, cut off at the largest
  double unlimited = 0;  ///< what it would be without saturation
  bool saturated = false;
};
struct GrayReference {
  ContactLight light;
  double albedo = 1;
  double gray = 0;         ///< measured change, > 0
  double most_gray = 255;  ///< largest change that the camera can show
};
/// Throws Error(Failure::Input) where the reference shows nothing, or an albedo is outside [0, 1].
PredictedGray predict_gray(const GrayReference& reference, const ContactLight& light, double albedo);

}  // namespace palpate::optics

// Slope errors: which part of a calibration's error is a frame's noise, and over what way the rest goes along
// with itself.
#pragma once

#include <array>
#include <span>

#include "engine/calibrate/photometric/press.h"
#include "palpate/frame.h"
#include "palpate/sensor.h"

namespace palpate::photometric {

/// Fills noise_sd and pad_reach_px of weights whose normal_sd is known, by what they leave of the presses.
/// `frame_sd`: standard deviation of one frame's red, green and blue, units of full scale; 0: not known, and
/// neither is filled.
void state_parts(std::span<const PhotometricPress> presses, const std::array<double, 3>& frame_sd,
                 const FrameFormat& format, PhotometricCalibration& weights);

}  // namespace palpate::photometric

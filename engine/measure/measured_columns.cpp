#include "engine/measure/measured_columns.h"

#include "engine/measure/depth_error.h"
#include "engine/sensor/fit.h"
#include "palpate/options.h"

namespace palpate {

MeasuredColumns MeasuredColumns::of(const Sensor& sensor, Outputs outputs, bool separate) {
  MeasuredColumns columns{Frame | Time};
  const auto add = [&columns](bool there, uint32_t more) { columns.groups |= there ? more : 0; };
  const bool touching = wants(outputs, Output::Force), surface = wants(outputs, Output::Surface);
  const bool skin = !separate && follows_skin(sensor, wants(outputs, Output::Skin), touching);
  const bool confidence = needs_confidence(sensor, outputs);
  const bool gradient = sensor.force && sensor.force->signal == ForceSignal::Gradient;
  add(touching, Touching);
  add(touching, has_scale(sensor) ? Millimetres : Pixels);
  add(touching && sensor.force, Force);
  add(touching && !separate, has_scale(sensor) ? ShiftMillimetres : ShiftPixels);
  add(touching && !separate && sensor.shear, Shear);
  add(touching && !separate && (sensor.shear || skin), Slipping);
  add(surface, Depth);
  add(surface && wants(outputs, Output::Contacts) && has_gel_contacts(sensor), Dented);
  add(surface && (sensor.reading == SurfaceReading::Elastic || sensor.lookup.depth_sd_mm > 0 ||
                  palpate::DepthError::states_error(sensor)),
      DepthError);
  add(surface && wants(outputs, Output::Contacts) && palpate::DepthError::states_seen(sensor), Extrapolated);
  add(confidence, Confidence);
  add(surface && confidence, Weighted);
  add(wants(outputs, Output::Contacts), Contacts);
  add(skin, Skin);
  add(wants(outputs, Output::Gradient) || (touching && gradient), Gradient);
  add(follows_light(sensor), Light);
  add(wants(outputs, Output::Traction), Traction);
  add(wants(outputs, Output::Motion) && !separate, Object);
  return columns;
}

}  // namespace palpate

#include "viz/live/tare.h"

#include <cmath>

#include "capture/files/measurements.h"

namespace palpate::viz {

bool Tare::set(const Touch& touch) {
  if (!has_value(touch.force_N)) return false;
  on = true;
  force_N = touch.force_N;
  shear_x_N = touch.shear_x_N;
  shear_y_N = touch.shear_y_N;
  contacts.clear();
  for (const ContactTouch& c : touch.contacts)
    contacts.push_back({c.id, c.force_N, c.shear_x_N, c.shear_y_N});
  return true;
}

std::string Tare::words() const {
  std::string all;
  const auto add = [&](const std::string& name, const Estimate& e) {
    if (has_value(e)) all += (all.empty() ? "" : " ") + name + "=" + shortest(e.value);
  };
  add("force_N", force_N);
  add("shear_x_N", shear_x_N);
  add("shear_y_N", shear_y_N);
  if (contacts.size() < 2) return all;  // the same once more
  for (const OfContact& c : contacts) {
    const std::string contact = "contact_" + std::to_string(c.id) + "_";
    add(contact + "force_N", c.force_N);
    add(contact + "shear_x_N", c.shear_x_N);
    add(contact + "shear_y_N", c.shear_y_N);
  }
  return all;
}

Estimate tared(const Estimate& measured, const Estimate& zero) {
  if (!has_value(measured) || !has_value(zero)) return measured;
  return {measured.value - zero.value, std::hypot(measured.standard_error, zero.standard_error),
          measured.validity};
}

Touch tared(const Touch& touch, const Tare& tare) {
  Touch shown = touch;
  if (!tare.on) return shown;
  shown.force_N = tared(touch.force_N, tare.force_N);
  shown.shear_x_N = tared(touch.shear_x_N, tare.shear_x_N);
  shown.shear_y_N = tared(touch.shear_y_N, tare.shear_y_N);
  for (ContactTouch& c : shown.contacts)
    for (const Tare::OfContact& zero : tare.contacts) {
      if (zero.id != c.id) continue;
      c.force_N = tared(c.force_N, zero.force_N);
      c.shear_x_N = tared(c.shear_x_N, zero.shear_x_N);
      c.shear_y_N = tared(c.shear_y_N, zero.shear_y_N);
    }
  return shown;
}

}  // namespace palpate::viz

#include "capture/v4l2/camera_setup.h"

#include <linux/videodev2.h>

#include <algorithm>
#include <cmath>

#include "capture/camera/frame_rate.h"
#include "engine/base/readable.h"
#include "palpate/error.h"

namespace palpate {
namespace {

using v4l2::Control;
using v4l2::Device;

constexpr double kSmooth_Hz = 25;  // below, motion looks broken
constexpr double kEnough_Hz = 60;  // unless more is asked for

std::string short_size(uint32_t width, uint32_t height) {
  return std::to_string(width) + "x" + std::to_string(height);
}

std::string list_of(const std::vector<v4l2::SizeRange>& sizes) {
  std::string list;
  for (const v4l2::SizeRange& s : sizes)
    list += (list.empty() ? "" : ", ") + short_size(s.least_width, s.least_height) +
            (s.single() ? "" : " to " + short_size(s.most_width, s.most_height));
  return list;
}

std::string list_of(const std::vector<v4l2::RateRange>& rates) {
  std::string list;
  for (const v4l2::RateRange& r : rates)
    list += (list.empty() ? "" : ", ") + rate_text(r.least_Hz) +
            (r.least_Hz == r.most_Hz ? "" : " to " + rate_text(r.most_Hz));
  return list;
}

double best_rate_Hz(const Device& device, uint32_t fourcc, uint32_t width, uint32_t height) {
  double best = 0;
  for (const v4l2::RateRange& rate : device.rates(fourcc, width, height)) best = std::max(best, rate.most_Hz);
  return best;
}

std::array<uint32_t, 2> choose_size(const Device& device, const PixelFormat& format,
                                    const CameraOptions& options, const CameraNeeds& needs) {
  const std::vector<v4l2::SizeRange> sizes = device.sizes(format.fourcc);
  std::array<uint32_t, 2> wanted = {options.width, options.height};
  if (wanted[0] == 0) wanted = needs.size_px;
  if (wanted[0] != 0) {
    const bool there = std::any_of(sizes.begin(), sizes.end(), [&](const v4l2::SizeRange& size) {
      return size.holds(wanted[0], wanted[1]);
    });
    if (!sizes.empty() && !there)
      throw Error(Failure::Device,
                  std::string(format.name) + " of " + short_size(wanted[0], wanted[1]) + " px from " +
                      device.identity().path,
                  list_of(sizes), "one of those");
    return wanted;
  }
  // A scaler's range says nothing of what the chip has; nor does a silent driver. Both have a size set.
  if (sizes.empty() || !sizes.front().single()) {
    const v4l2::Negotiated now = device.format();
    return {now.width, now.height};
  }
  const double enough_Hz = options.rate_Hz > 0 ? options.rate_Hz * 0.99 : kSmooth_Hz;
  const v4l2::SizeRange* best = &sizes.front();
  double best_Hz = -1;
  const auto area = [](const v4l2::SizeRange& s) { return uint64_t{s.most_width} * s.most_height; };
  for (const v4l2::SizeRange& size : sizes) {
    const double rate_Hz =
        std::min(enough_Hz, best_rate_Hz(device, format.fourcc, size.most_width, size.most_height));
    if (rate_Hz > best_Hz || (rate_Hz == best_Hz && area(size) > area(*best))) {
      best = &size;
      best_Hz = rate_Hz;
    }
  }
  return {best->most_width, best->most_height};
}

double choose_rate(Device& device, const CameraSetup& setup, const CameraOptions& options) {
  const uint32_t width = setup.image.width, height = setup.image.height;
  if (!(options.rate_Hz > 0)) {
    const double most_Hz = std::min(kEnough_Hz, best_rate_Hz(device, setup.format->fourcc, width, height));
    const double now_Hz = most_Hz > 0 ? device.set_rate(most_Hz) : 0;
    return now_Hz > 0 ? now_Hz : device.rate_Hz();
  }
  const double set_Hz = device.set_rate(options.rate_Hz);
  if (std::abs(set_Hz - options.rate_Hz) <= 0.01 * options.rate_Hz) return set_Hz;
  const auto rates = device.rates(setup.format->fourcc, setup.image.width, setup.image.height);
  throw Error(Failure::Device,
              rate_text(options.rate_Hz) + " frames/s of " +
                  short_size(setup.image.width, setup.image.height) + " px from " + device.identity().path,
              set_Hz > 0 ? rate_text(set_Hz) : "no rate that can be set",
              rates.empty() ? "no --fps" : "one of " + list_of(rates));
}

void set_and_check(Device& device, const std::vector<ControlStep>& steps) {
  for (const ControlStep& step : steps) {
    const int error = device.set(step.id, step.value);
    if (error != 0)
      throw Error(Failure::Device, "control " + step.name + " at " + std::to_string(step.value),
                  "that " + device.identity().path + " refuses: " + system_words(error),
                  "palpate cameras " + device.identity().path);
  }
}

}  // namespace

CameraSetup set_up(Device& device, const CameraOptions& options, const CameraNeeds& needs) {
  if (!options.trigger.empty())
    throw Error(Failure::Device, "frames triggered by " + options.trigger,
                device.identity().path + ", a camera of Linux (V4L2), which has no common trigger",
                "--control with the driver's own name for it, or no --trigger");
  CameraSetup setup;
  setup.format = &choose_format(device.formats(),
                                device.identity().path + " (" + device.identity().card + ")", options, needs);
  setup.channels = needs.channels != 0 ? needs.channels : setup.format->channels;
  const auto [width, height] = choose_size(device, *setup.format, options, needs);
  setup.image = device.set_format(setup.format->fourcc, width, height);
  const v4l2::Negotiated& n = setup.image;
  if (n.fourcc != setup.format->fourcc || n.width != width || n.height != height) {
    const auto sizes = device.sizes(setup.format->fourcc);
    throw Error(Failure::Device,
                std::string(setup.format->name) + " of " + short_size(width, height) + " px from " +
                    device.identity().path,
                fourcc_text(n.fourcc) + " of " + short_size(n.width, n.height),
                sizes.empty() ? "what palpate cameras lists" : list_of(sizes));
  }
  setup.rate_Hz = choose_rate(device, setup, options);
  const std::vector<ControlStep> steps = plan_controls(device.controls(), options);
  set_and_check(device, steps);
  setup.controls = device.controls();
  for (const ControlStep& step : steps) {
    const auto c = std::find_if(setup.controls.begin(), setup.controls.end(),
                                [&](const Control& control) { return control.id == step.id; });
    if (c == setup.controls.end() || !c->value) continue;
    const double off = std::abs(double(*c->value - step.value));
    if (off <= double(c->step) || off <= 0.01 * std::abs(double(step.value))) continue;
    throw Error(Failure::Device, "control " + step.name + " at " + std::to_string(step.value),
                device.identity().path + ", which keeps it at " + std::to_string(*c->value),
                "another value, or the mode that rules it");
  }
  return setup;
}

std::string restore_controls(Device& device, const std::vector<Control>& before) {
  std::string failed;
  // Twice: values that an automatic mode rules can be set only once that is off.
  for (int pass = 0; pass < 2; ++pass) {
    failed.clear();
    for (const Control& c : before) {
      if (!c.value || c.read_only || c.write_only || c.inactive || device.get(c.id) == c.value) continue;
      if (device.set(c.id, *c.value) != 0) failed += (failed.empty() ? "" : ", ") + c.name;
    }
  }
  return failed;
}

std::string camera_node(const std::string& asked) {
  if (!asked.empty()) {
    const bool number = asked.find_first_not_of("0123456789") == std::string::npos;
    return number ? "/dev/video" + asked : asked;
  }
  for (const v4l2::NodeReport& node : v4l2::list_nodes())
    if (node.capture) return node.path;
  throw Error(Failure::Device, "a camera", "none on this machine", "plugging one in, and palpate cameras");
}

}  // namespace palpate

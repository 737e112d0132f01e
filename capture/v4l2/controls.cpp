// The controls of a camera: listing, reading, setting.
#include <linux/videodev2.h>

#include <algorithm>
#include <cstring>

#include "capture/v4l2/device.h"

namespace palpate::v4l2 {
namespace {

ControlType type_of(uint32_t type) {
  switch (type) {
    case V4L2_CTRL_TYPE_INTEGER:
    case V4L2_CTRL_TYPE_INTEGER64:
    case V4L2_CTRL_TYPE_BITMASK:
      return ControlType::Integer;
    case V4L2_CTRL_TYPE_BOOLEAN:
      return ControlType::Boolean;
    case V4L2_CTRL_TYPE_MENU:
    case V4L2_CTRL_TYPE_INTEGER_MENU:
      return ControlType::Menu;
    case V4L2_CTRL_TYPE_BUTTON:
      return ControlType::Button;
    default:
      return ControlType::Other;
  }
}

/// Reads a control of any type but Other.
std::optional<int64_t> read(int file, uint32_t id, bool wide) {
  v4l2_ext_control control{};
  control.id = id;
  v4l2_ext_controls list{};
  list.which = V4L2_CTRL_WHICH_CUR_VAL;
  list.count = 1;
  list.controls = &control;
  if (call(file, VIDIOC_G_EXT_CTRLS, &list) == 0) return wide ? control.value64 : int64_t{control.value};
  v4l2_control old{id, 0};  // drivers of old know only these
  if (wide || call(file, VIDIOC_G_CTRL, &old) != 0) return std::nullopt;
  return old.value;
}

bool is_wide(int file, uint32_t id) {
  v4l2_query_ext_ctrl about{};
  about.id = id;
  return call(file, VIDIOC_QUERY_EXT_CTRL, &about) == 0 && about.type == V4L2_CTRL_TYPE_INTEGER64;
}

}  // namespace

std::vector<Control> Device::controls() const {
  std::vector<Control> list;
  v4l2_query_ext_ctrl about{};
  for (about.id = V4L2_CTRL_FLAG_NEXT_CTRL; call(file_, VIDIOC_QUERY_EXT_CTRL, &about) == 0;
       about.id |= V4L2_CTRL_FLAG_NEXT_CTRL) {
    const ControlType type = type_of(about.type);
    if (about.flags & V4L2_CTRL_FLAG_DISABLED || about.type == V4L2_CTRL_TYPE_CTRL_CLASS) continue;
    Control c;
    c.id = about.id;
    c.name = control_name({about.name, strnlen(about.name, sizeof about.name)});
    c.type = type;
    c.least = about.minimum;
    c.most = about.maximum;
    c.step = std::max<int64_t>(1, static_cast<int64_t>(about.step));
    c.initial = about.default_value;
    c.read_only = (about.flags & V4L2_CTRL_FLAG_READ_ONLY) != 0;
    c.write_only = (about.flags & V4L2_CTRL_FLAG_WRITE_ONLY) != 0 || type == ControlType::Button;
    c.inactive = (about.flags & V4L2_CTRL_FLAG_INACTIVE) != 0;
    c.grabbed = (about.flags & V4L2_CTRL_FLAG_GRABBED) != 0;
    if (type != ControlType::Other && !c.write_only)
      c.value = read(file_, about.id, about.type == V4L2_CTRL_TYPE_INTEGER64);
    for (int64_t i = c.least; type == ControlType::Menu && i <= c.most; ++i) {
      v4l2_querymenu item{};
      item.id = about.id;
      item.index = static_cast<uint32_t>(i);
      if (call(file_, VIDIOC_QUERYMENU, &item) != 0) continue;
      const auto* name = reinterpret_cast<const char*>(item.name);
      c.items.emplace_back(i, about.type == V4L2_CTRL_TYPE_MENU
                                  ? std::string(name, strnlen(name, sizeof item.name))
                                  : std::to_string(item.value));
    }
    list.push_back(std::move(c));
  }
  return list;
}

std::optional<int64_t> Device::get(uint32_t id) const {
  return read(file_, id, is_wide(file_, id));
}

int Device::set(uint32_t id, int64_t value) {
  v4l2_ext_control control{};
  control.id = id;
  if (is_wide(file_, id)) {
    control.value64 = value;
  } else {
    control.value = static_cast<int32_t>(value);
  }
  v4l2_ext_controls list{};
  list.which = V4L2_CTRL_WHICH_CUR_VAL;
  list.count = 1;
  list.controls = &control;
  if (call(file_, VIDIOC_S_EXT_CTRLS, &list) == 0) return 0;
  v4l2_control old{id, static_cast<int32_t>(value)};
  return call(file_, VIDIOC_S_CTRL, &old);
}

}  // namespace palpate::v4l2

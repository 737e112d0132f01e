#include "capture/v4l2/device.h"

#include <fcntl.h>
#include <grp.h>
#include <linux/videodev2.h>
#include <sys/ioctl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>

#include "capture/camera/frame_rate.h"
#include "engine/base/readable.h"
#include "palpate/error.h"

namespace fs = std::filesystem;

namespace palpate::v4l2 {
namespace {

template <size_t n>
std::string text_of(const __u8 (&bytes)[n]) {
  const auto* begin = reinterpret_cast<const char*>(bytes);
  return {begin, strnlen(begin, n)};
}

int node_index(const std::string& path) {
  std::error_code error;
  const fs::path node = fs::canonical(path, error);
  std::ifstream in("/sys/class/video4linux/" + node.filename().string() + "/index");
  int index = 0;
  return in >> index ? index : 0;
}

uint32_t capabilities(int file, Identity& identity) {
  v4l2_capability caps{};
  if (call(file, VIDIOC_QUERYCAP, &caps) != 0) return 0;
  identity.driver = text_of(caps.driver);
  identity.card = text_of(caps.card);
  identity.bus = text_of(caps.bus_info);
  return caps.capabilities & V4L2_CAP_DEVICE_CAPS ? caps.device_caps : caps.capabilities;
}

constexpr uint32_t kNeeded = V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_STREAMING;

std::vector<std::string> node_paths() {
  std::vector<std::string> paths;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator("/dev", error)) {
    const std::string name = entry.path().filename().string();
    if (name.rfind("video", 0) == 0 && name.size() > 5 && std::isdigit(static_cast<unsigned char>(name[5])))
      paths.push_back(entry.path().string());
  }
  // video2 before video10
  std::sort(paths.begin(), paths.end(), [](const std::string& a, const std::string& b) {
    return a.size() != b.size() ? a.size() < b.size() : a < b;
  });
  return paths;
}

/// Advice where a camera does not exist.
std::string another_camera() {
  std::string list;
  for (const NodeReport& node : list_nodes())
    if (node.capture) list += (list.empty() ? "" : ", ") + node.path + " (" + node.identity.card + ")";
  return list.empty() ? "plugging a camera in; palpate cameras lists those there are" : "one of " + list;
}

Error no_permission(const std::string& path) {
  struct stat about {};
  std::string who = "root", remedy = "running as root";
  if (stat(path.c_str(), &about) == 0) {
    const group* owners = getgrgid(about.st_gid);
    const std::string name = owners ? owners->gr_name : std::to_string(about.st_gid);
    if (about.st_mode & S_IRGRP && about.st_mode & S_IWGRP) {
      who = "group '" + name + "'";
      remedy = "joining the group: sudo usermod -aG " + name + " $USER, then log in again";
    }
  }
  return {Failure::Device, "to open the camera " + path, "no permission, it belongs to " + who, remedy};
}

}  // namespace

int call(int file, unsigned long request, void* argument) {
  while (ioctl(file, request, argument) == -1)
    if (errno != EINTR) return errno;
  return 0;
}

bool SizeRange::holds(uint32_t width, uint32_t height) const {
  return width >= least_width && width <= most_width && height >= least_height && height <= most_height &&
         (width - least_width) % std::max(1u, step_width) == 0 &&
         (height - least_height) % std::max(1u, step_height) == 0;
}

std::string unit_of(uint32_t id) {
  switch (id) {
    case V4L2_CID_EXPOSURE_ABSOLUTE:
      return "100 us";
    case V4L2_CID_WHITE_BALANCE_TEMPERATURE:
      return "K";
    case V4L2_CID_AUTO_EXPOSURE_BIAS:
      return "0.001 EV";
    case V4L2_CID_PAN_ABSOLUTE:
    case V4L2_CID_TILT_ABSOLUTE:
      return "arc seconds";
    case V4L2_CID_PIXEL_RATE:
      return "px/s";
    case V4L2_CID_LINK_FREQ:
      return "Hz";
    default:
      return {};
  }
}

std::string control_name(const std::string& driver_name) {
  std::string name;
  for (const char c : driver_name) {
    const auto u = static_cast<unsigned char>(c);
    if (std::isalnum(u)) {
      name += static_cast<char>(std::tolower(u));
    } else if (!name.empty() && name.back() != '_') {
      name += '_';
    }
  }
  while (!name.empty() && name.back() == '_') name.pop_back();
  return name;
}

Device::Device(const std::string& path) {
  identity_.path = path;
  do {
    file_ = open(path.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC);
  } while (file_ < 0 && errno == EINTR);
  const int error = file_ < 0 ? errno : 0;
  if (error == EACCES || error == EPERM) throw no_permission(path);
  if (error == ENOENT)
    throw Error(Failure::Device, "a camera at " + path, "no such device node", another_camera());
  if (error == EBUSY) {
    const std::string who = holders_of(path);
    throw Error(Failure::Device, "to open the camera " + path,
                "another program using it" + (who.empty() ? "" : ": " + who), "ending that program");
  }
  if (error == ENODEV || error == ENXIO)
    throw Error(Failure::Device, "a camera at " + path, "a device node without a camera: it was unplugged",
                "plugging it in again");
  if (error != 0)
    throw Error(Failure::Device, "to open the camera " + path, system_words(error), "palpate cameras");
  const uint32_t caps = capabilities(file_, identity_);
  identity_.index = node_index(path);
  if ((caps & kNeeded) == kNeeded) return;
  close(file_);
  const std::string found = caps == 0 ? "something else"
                            : caps & V4L2_CAP_VIDEO_CAPTURE_MPLANE
                                ? "one that only speaks the multi-planar interface"
                            : caps & V4L2_CAP_META_CAPTURE  ? "the node of its metadata"
                            : caps & V4L2_CAP_VIDEO_CAPTURE ? "one that cannot stream"
                                                            : "a node that delivers no frames";
  throw Error(Failure::Device, "a camera at " + path,
              found + (identity_.card.empty() ? "" : " (" + identity_.card + ")"), another_camera());
}

Device::~Device() {
  close(file_);
}

std::vector<OfferedFormat> Device::formats() const {
  std::vector<OfferedFormat> list;
  for (uint32_t i = 0;; ++i) {
    v4l2_fmtdesc about{};
    about.index = i;
    about.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    if (call(file_, VIDIOC_ENUM_FMT, &about) != 0) return list;
    list.push_back({about.pixelformat, text_of(about.description),
                    (about.flags & V4L2_FMT_FLAG_COMPRESSED) != 0,
                    (about.flags & V4L2_FMT_FLAG_EMULATED) != 0, find_pixel_format(about.pixelformat)});
  }
}

std::vector<SizeRange> Device::sizes(uint32_t fourcc) const {
  std::vector<SizeRange> list;
  for (uint32_t i = 0;; ++i) {
    v4l2_frmsizeenum size{};
    size.index = i;
    size.pixel_format = fourcc;
    if (call(file_, VIDIOC_ENUM_FRAMESIZES, &size) != 0) return list;
    if (size.type == V4L2_FRMSIZE_TYPE_DISCRETE) {
      const uint32_t w = size.discrete.width, h = size.discrete.height;
      list.push_back({w, w, 1, h, h, 1});
    } else {
      const v4l2_frmsize_stepwise& s = size.stepwise;
      list.push_back({s.min_width, s.max_width, s.step_width, s.min_height, s.max_height, s.step_height});
      return list;
    }
  }
}

std::vector<RateRange> Device::rates(uint32_t fourcc, uint32_t width, uint32_t height) const {
  const auto rate_Hz = [](const v4l2_fract& interval) {
    return interval.numerator == 0 ? 0.0 : double(interval.denominator) / interval.numerator;
  };
  std::vector<RateRange> list;
  for (uint32_t i = 0;; ++i) {
    v4l2_frmivalenum interval{};
    interval.index = i;
    interval.pixel_format = fourcc;
    interval.width = width;
    interval.height = height;
    if (call(file_, VIDIOC_ENUM_FRAMEINTERVALS, &interval) != 0) return list;
    if (interval.type == V4L2_FRMIVAL_TYPE_DISCRETE) {
      list.push_back({rate_Hz(interval.discrete), rate_Hz(interval.discrete)});
    } else {
      list.push_back({rate_Hz(interval.stepwise.max), rate_Hz(interval.stepwise.min)});
      return list;
    }
  }
}

Negotiated Device::format() const {
  v4l2_format format{};
  format.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  if (const int error = call(file_, VIDIOC_G_FMT, &format); error != 0)
    throw Error(Failure::Device, "the frame format of " + identity_.path, system_words(error),
                "palpate cameras");
  const v4l2_pix_format& p = format.fmt.pix;
  return {p.pixelformat, p.width, p.height, p.bytesperline, p.sizeimage};
}

Negotiated Device::set_format(uint32_t fourcc, uint32_t width, uint32_t height) {
  v4l2_format format{};
  format.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  format.fmt.pix.pixelformat = fourcc;
  format.fmt.pix.width = width;
  format.fmt.pix.height = height;
  format.fmt.pix.field = V4L2_FIELD_NONE;
  const int error = call(file_, VIDIOC_S_FMT, &format);
  if (error == EBUSY) {
    const std::string who = holders_of(identity_.path);
    throw Error(Failure::Device, "the camera " + identity_.path + " (" + identity_.card + ")",
                "another program using it" + (who.empty() ? "" : ": " + who), "ending that program");
  }
  if (error != 0)
    throw Error(Failure::Device,
                fourcc_text(fourcc) + " of " + std::to_string(width) + "x" + std::to_string(height) +
                    " px from " + identity_.path,
                system_words(error), "what palpate cameras " + identity_.path + " lists");
  const v4l2_pix_format& p = format.fmt.pix;
  return {p.pixelformat, p.width, p.height, p.bytesperline, p.sizeimage};
}

double Device::rate_Hz() const {
  v4l2_streamparm parameters{};
  parameters.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  if (call(file_, VIDIOC_G_PARM, &parameters) != 0) return 0;
  const v4l2_fract& interval = parameters.parm.capture.timeperframe;
  return interval.numerator == 0 ? 0 : double(interval.denominator) / interval.numerator;
}

double Device::set_rate(double rate_Hz) {
  v4l2_streamparm parameters{};
  parameters.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  if (call(file_, VIDIOC_G_PARM, &parameters) != 0) return 0;
  if (!(parameters.parm.capture.capability & V4L2_CAP_TIMEPERFRAME)) return 0;
  const RateFraction rate = rate_fraction(rate_Hz);
  parameters.parm.capture.timeperframe = {rate.seconds, rate.frames};
  if (call(file_, VIDIOC_S_PARM, &parameters) != 0) return 0;
  return this->rate_Hz();
}

std::vector<NodeReport> list_nodes() {
  std::vector<NodeReport> list;
  for (const std::string& path : node_paths()) {
    NodeReport node;
    node.path = node.identity.path = path;
    const int file = open(path.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC);
    if (file < 0) {
      const int error = errno;
      node.trouble =
          error == EACCES || error == EPERM ? std::string(no_permission(path).what()) : system_words(error);
    } else {
      node.capture = (capabilities(file, node.identity) & kNeeded) == kNeeded;
      node.identity.index = node_index(path);
      close(file);
    }
    list.push_back(node);
  }
  return list;
}

std::string holders_of(const std::string& path) {
  std::error_code error;
  const fs::path node = fs::canonical(path, error);
  std::string list;
  for (const auto& process : fs::directory_iterator("/proc", error)) {
    const std::string pid = process.path().filename().string();
    if (!std::isdigit(static_cast<unsigned char>(pid[0])) || pid == std::to_string(getpid())) continue;
    std::error_code hidden;  // another user's, or gone by now
    for (const auto& entry : fs::directory_iterator(process.path() / "fd", hidden)) {
      if (fs::read_symlink(entry.path(), hidden) != node) continue;
      std::ifstream in(process.path() / "comm");
      std::string name;
      std::getline(in, name);
      if (!list.empty()) list += ", ";
      list.append(name).append(" (").append(pid).append(")");
      break;
    }
  }
  return list;
}

}  // namespace palpate::v4l2

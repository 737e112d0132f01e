#include "capture/v4l2/usb_budget.h"

#include <algorithm>
#include <charconv>
#include <fstream>
#include <map>
#include <mutex>

#include "engine/base/text.h"
#include "palpate/error.h"

namespace fs = std::filesystem;

namespace palpate::v4l2 {
namespace {

struct Share {
  UsbPlace place;
  std::string camera;
  double bytes_per_s;
};
/// Of all cameras that stream.
struct Shares {
  std::mutex mutex;
  std::map<uint64_t, Share> by_id;
  uint64_t next = 0;
};
Shares& shares() {
  static Shares all;
  return all;
}

std::string word_of(const fs::path& file) {
  std::ifstream in(file);
  std::string word;
  in >> word;
  return word;
}

std::string megabytes(double bytes_per_s) {
  return text("%.1f MB/s", 1e-6 * bytes_per_s);
}

}  // namespace

std::optional<UsbPlace> usb_place(const std::string& node, const fs::path& sys) {
  std::error_code none;
  const fs::path link = sys / "class/video4linux" / fs::path(node).filename() / "device";
  fs::path at = fs::canonical(link, none);
  while (at.has_relative_path() && !fs::exists(at / "busnum")) at = at.parent_path();
  UsbPlace place{.bus = word_of(at / "busnum"), .speed_Mbit = 0};
  const std::string speed = word_of(at / "speed");
  std::from_chars(speed.data(), speed.data() + speed.size(), place.speed_Mbit);
  if (place.bus.empty() || !(place.speed_Mbit > 0)) return std::nullopt;
  return place;
}

double usb_capacity(double speed_Mbit) {
  if (speed_Mbit < 480) return 1023 * 1000.0;
  if (speed_Mbit < 5000) return 6 * 1024 * 8000.0;
  const double coding = speed_Mbit < 10000 ? 8.0 / 10 : 128.0 / 132;
  return 0.8 * coding * speed_Mbit * 1e6 / 8;
}

UsbShare::UsbShare(const UsbPlace& place, const std::string& camera, const UsbMode& wanted,
                   const std::function<std::vector<UsbMode>()>& offers) {
  Shares& all = shares();
  const std::lock_guard lock(all.mutex);
  double left = usb_capacity(place.speed_Mbit);
  std::string others;
  for (const auto& [id, share] : all.by_id) {
    // A slower device takes part of the same wires only on a bus of its own speed.
    if (share.place.bus != place.bus || share.place.speed_Mbit != place.speed_Mbit) continue;
    left -= share.bytes_per_s;
    others += ", " + megabytes(share.bytes_per_s) + " taken by " + share.camera;
  }
  if (wanted.bytes_per_s > left) {
    std::optional<UsbMode> best;
    for (const UsbMode& mode : offers())
      if (mode.bytes_per_s <= left && (!best || mode.bytes_per_s > best->bytes_per_s)) best = mode;
    throw Error(
        Failure::Device, megabytes(wanted.bytes_per_s) + " of USB bus " + place.bus + " for " + camera,
        megabytes(std::max(0.0, left)) + " left of " + megabytes(usb_capacity(place.speed_Mbit)) + others,
        best ? best->words + ", which fits" : "a port of another USB controller for one of them");
  }
  id_ = all.next++;
  all.by_id[id_] = {place, camera, wanted.bytes_per_s};
}

UsbShare::~UsbShare() {
  Shares& all = shares();
  const std::lock_guard lock(all.mutex);
  all.by_id.erase(id_);
}

}  // namespace palpate::v4l2

// What a USB bus carries: places in a tree made as the kernel's, and sums before a camera streams.
#include "capture/v4l2/usb_budget.h"

#include "palpate/error.h"
#include "tests/support/text_file.h"

namespace palpate::v4l2 {
namespace {

namespace fs = std::filesystem;

TEST(UsbBudget, FindsBusAndSpeedOfANode) {
  const fs::path sys = fs::path(testing::TempDir()) / "usb_sys";
  fs::remove_all(sys);
  const fs::path device = sys / "devices/usb3/3-1/3-1.4";
  fs::create_directories(device / "3-1.4:1.0");
  fs::create_directories(sys / "devices/platform/vivid.0");
  spill(device / "busnum", "3\n");
  spill(device / "speed", "480\n");
  const auto node = [&](const std::string& name, const fs::path& at) {
    fs::create_directories(sys / "class/video4linux" / name);
    fs::create_directory_symlink(at, sys / "class/video4linux" / name / "device");
  };
  node("video2", device / "3-1.4:1.0");
  node("video7", sys / "devices/platform/vivid.0");
  const std::optional<UsbPlace> place = usb_place("/dev/video2", sys);
  ASSERT_TRUE(place);
  EXPECT_EQ(place->bus, "3");
  EXPECT_EQ(place->speed_Mbit, 480);
  EXPECT_FALSE(usb_place("/dev/video7", sys));
  EXPECT_FALSE(usb_place("/dev/video9", sys));
  fs::remove_all(sys);
}

constexpr double kYuyv = 640 * 480 * 2;

std::vector<UsbMode> modes() {
  return {
      {"--fps 60", kYuyv * 60}, {"--fps 15", kYuyv * 15}, {"--fps 30", kYuyv * 30}, {"--fps 5", kYuyv * 5}};
}

TEST(UsbBudget, RefusesTheCameraThatNoLongerFitsAndSaysWhatDoes) {
  const UsbPlace bus{"3", 480};
  const UsbMode thirty{"--fps 30", kYuyv * 30};
  std::optional<UsbShare> first(std::in_place, bus, "left", thirty, modes);
  const UsbShare second(bus, "right", thirty, modes);
  try {
    const UsbShare third(bus, "third", {"--fps 60", kYuyv * 60}, modes);
    ADD_FAILURE() << "fits";
  } catch (const Error& error) {
    EXPECT_EQ(error.failure(), Failure::Device);
    EXPECT_STREQ(
        error.what(),
        "wanted 36.9 MB/s of USB bus 3 for third; found 12.3 MB/s left of 49.2 MB/s, 18.4 MB/s taken by "
        "left, 18.4 MB/s taken by right; try --fps 15, which fits");
  }
  // Another bus, another speed, or one that has gone, leave room.
  const UsbShare elsewhere({"4", 480}, "third", thirty, modes), faster({"3", 5000}, "third", thirty, modes);
  first.reset();
  const UsbShare again(bus, "third", thirty, modes);
  EXPECT_THROW(UsbShare(bus, "fourth", thirty, [] { return std::vector<UsbMode>{}; }), Error);
}

TEST(UsbBudget, CapacitiesAreThoseOfTheStandards) {
  EXPECT_NEAR(usb_capacity(12), 1.023e6, 1);
  EXPECT_NEAR(usb_capacity(480), 49.152e6, 1);
  EXPECT_NEAR(usb_capacity(5000), 400e6, 1);
  EXPECT_GT(usb_capacity(10000), 900e6);
}

}  // namespace
}  // namespace palpate::v4l2

// Cameras by port and serial number, in a tree made as the kernel's.
#include "capture/v4l2/camera_name.h"

#include "palpate/error.h"
#include "tests/support/text_file.h"

namespace palpate::v4l2 {
namespace {

namespace fs = std::filesystem;

class CameraName : public testing::Test {
 protected:
  void SetUp() override {
    sys_ = fs::path(testing::TempDir()) / "sys";
    fs::remove_all(sys_);
    fs::create_directories(sys_ / "class/video4linux");
    usb(4, "1-2.1", "A7", "GelSight Mini");
    usb(0, "1-1", "", "Webcam");
    // The second node of a camera delivers no frames of its own.
    node(5, "devices/usb1/1-2.1/1-2.1:1.0", "GelSight Mini", 1);
    fs::create_directories(sys_ / "devices/platform/vivid.0");
    node(9, "devices/platform/vivid.0", "vivid", 0);
  }
  void TearDown() override { fs::remove_all(sys_); }

  void usb(int number, const std::string& port, const std::string& serial, const std::string& card) {
    const fs::path device = sys_ / "devices/usb1" / port;
    fs::create_directories(device / (port + ":1.0"));
    spill(device / "busnum", "1\n");
    spill(device / "devpath", port.substr(2) + "\n");
    if (!serial.empty()) spill(device / "serial", serial + "\n");
    node(number, "devices/usb1/" + port + "/" + port + ":1.0", card, 0);
  }
  void node(int number, const fs::path& device, const std::string& card, int index) {
    const fs::path folder = sys_ / "class/video4linux" / ("video" + std::to_string(number));
    fs::create_directories(folder);
    spill(folder / "name", card + "\n");
    spill(folder / "index", std::to_string(index) + "\n");
    fs::create_directory_symlink(sys_ / device, folder / "device");
  }
  std::string refused(const std::string& name) {
    try {
      return "found " + find_camera(name, named_cameras(sys_));
    } catch (const Error& error) {
      EXPECT_EQ(error.failure(), Failure::Device);
      return error.what();
    }
  }
  fs::path sys_;
};

TEST_F(CameraName, IsThePortOrTheSerialNumber) {
  const std::vector<NamedCamera> cameras = named_cameras(sys_);
  ASSERT_EQ(cameras.size(), 3u);
  EXPECT_EQ(find_camera("1-2.1", cameras), "/dev/video4");
  EXPECT_EQ(find_camera("A7", cameras), "/dev/video4");
  EXPECT_EQ(find_camera("1-1", cameras), "/dev/video0");
  EXPECT_EQ(find_camera("vivid.0", cameras), "/dev/video9");
}

TEST_F(CameraName, OfSeveralOnOneDeviceTheCardTellsThemApart) {
  fs::create_directories(sys_ / "devices/platform/vivid.1");
  node(10, "devices/platform/vivid.1", "left eye", 0);
  node(12, "devices/platform/vivid.1", "right eye", 0);
  const std::vector<NamedCamera> cameras = named_cameras(sys_);
  EXPECT_EQ(find_camera("left eye", cameras), "/dev/video10");
  EXPECT_EQ(find_camera("right eye", cameras), "/dev/video12");
  EXPECT_EQ(find_camera("vivid.0", cameras), "/dev/video9");
  EXPECT_TRUE(contains(refused("vivid.1"), "found 'vivid.1', which several have"));
  EXPECT_TRUE(contains(refused("vivid.1"), "left eye, right eye"));
}

TEST_F(CameraName, ANumberIsRefusedWithTheNames) {
  for (const char* number : {"0", "/dev/video4"})
    EXPECT_EQ(refused(number),
              std::string("wanted a camera by its port or serial number; found '") + number +
                  "', a number that another camera may get at the next start; try 1-1 (Webcam), "
                  "1-2.1 or A7 (GelSight Mini), vivid.0 (vivid)");
  EXPECT_TRUE(contains(refused("1-9"), "found '1-9'; try 1-1 (Webcam)"));
  EXPECT_TRUE(contains(refused(""), "try 1-1"));
  usb(11, "1-3", "A7", "GelSight Mini");
  EXPECT_TRUE(contains(refused("A7"), "which several have"));
  EXPECT_TRUE(named_cameras(sys_ / "none").empty());
}

}  // namespace
}  // namespace palpate::v4l2

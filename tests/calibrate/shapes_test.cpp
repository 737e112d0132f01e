// Calibrations by cylinders, cones, dots and balls, each judged by depth on the other shapes.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <map>
#include <numbers>
#include <string>
#include <vector>

#include "capture/calibrate/photometric/ball_verdict.h"
#include "capture/calibrate/photometric/presses.h"
#include "capture/calibrate/photometric/shape_text.h"
#include "capture/calibrate/workflow/workflow.h"
#include "engine/base/text.h"
#include "engine/calibrate/photometric/fit.h"
#include "engine/sensor/polynomial_normal.h"
#include "palpate/error.h"
#include "tests/scenes/pressed_shapes.h"
#include "tests/support/test_folder.h"

namespace palpate {
namespace {

namespace fs = std::filesystem;
using scenes::contact_at, scenes::PressedPlace, scenes::ShapePictures;

constexpr const char *kBall = "ball:radius=4", *kCylinder = "cylinder:radius=2",
                     *kCone = "cone:half-angle=62:tip-radius=0.3";

class Shapes : public testing::Test {
 protected:
  using Contacts = std::vector<FoundBall>;

  void SetUp() override {
    folder_ = test_folder("shapes");
    pictures_.save(folder_ / "rest.png", {});
  }
  void TearDown() override {
    if (!HasFailure()) fs::remove_all(folder_);
  }

  /// Places all over the pad, widths and, of a cylinder, directions.
  static Contacts contacts(const char* shape) {
    const bool cylinder = shape == kCylinder;
    Contacts contacts;
    for (int i = 0; i < 9; ++i) {
      const double x = 80 + 80 * (i % 3) + 7 * ((i * 5) % 3 - 1), y = 65 + 55 * static_cast<int>(i / 3);
      const double wide = cylinder ? 9 + 0.5 * ((i * 7) % 9) : 15 + ((i * 7) % 9);
      contacts.push_back(cylinder ? contact_at(x, y, wide, 0.1 + std::numbers::pi / 9 * ((i * 4) % 9), 44 + i)
                                  : contact_at(x, y, wide));
    }
    return contacts;
  }
  static PressedPlace place(const char* shape, const FoundBall& contact) {
    return {parse_shape(shape), contact, ShapePictures::kPitch_mm};
  }
  std::string save(const char* shape, const Contacts& contacts, const std::string& name) {
    for (size_t i = 0; i < contacts.size(); ++i)
      pictures_.save(folder_ / name / text("%02zu.png", i), {place(shape, contacts[i])});
    return (folder_ / name).string();
  }
  std::string save(const char* shape) { return save(shape, contacts(shape), std::string(shape, 4)); }

  PhotometricRequest request(const std::string& input, std::vector<std::string> shapes) const {
    PhotometricRequest request;
    request.input = input;
    request.background = folder_ / "rest.png";
    request.pitch_mm_per_px = ShapePictures::kPitch_mm;
    request.shapes = std::move(shapes);
    return request;
  }
  CalibrationReport calibrated(const std::string& input, std::vector<std::string> shapes) const {
    return calibrate_photometric(request(input, std::move(shapes)), {{}, watch_});
  }
  BallPresses found(const std::string& input, const PressedShape& shape) const {
    Sensor sensor;
    sensor.channels = 3;
    sensor.pitch_mm_per_px = ShapePictures::kPitch_mm;
    sensor.background.image = (folder_ / "rest.png").string();
    PressSearch search;
    search.shape = shape;
    return find_presses(input, sensor, search, 1);
  }

  /// RMS error of the depth over the inner 80 % of a contact, over the RMS of the depth there.
  double depth_error(const PhotometricCalibration& calibration, const char* shape, const FoundBall& contact) {
    const std::vector<PressedPlace> places{place(shape, contact)};
    const Frame frame = pictures_.picture(places), rest = pictures_.picture({});
    const FrameFormat& f = frame.format;
    const size_t pixels = size_t{f.width} * f.height;
    std::vector<double> sx(pixels), sy(pixels), truth(pixels);
    std::vector<uint8_t> inside(pixels);
    for (uint32_t y = 0; y < f.height; ++y)
      for (uint32_t x = 0; x < f.width; ++x) {
        const MiddleOffset offset = offset_from(contact, x, y);
        if (offset.at_end || offset.px > 0.8 * contact.radius_px) continue;
        std::array<double, 3> change{};
        for (uint32_t c = 0; c < 3; ++c)
          change[c] =
              (static_cast<double>(frame.at(c, x, y)) - static_cast<double>(rest.at(c, x, y))) / f.max_gray();
        const auto n =
            polynomial_normal(calibration, change, (2.0 * x + 1) / f.width - 1, (2.0 * y + 1) / f.height - 1);
        const double nz = std::sqrt(1 - n[0] * n[0] - n[1] * n[1]);
        const size_t i = size_t{y} * f.width + x;
        inside[i] = 1, sx[i] = n[0] / nz, sy[i] = n[1] / nz;
        truth[i] = ShapePictures::depth_mm(places, x, y);
      }
    const std::vector<double> depth = integrate_patch(sx, sy, inside, f.width, ShapePictures::kPitch_mm);
    double n = 0, mean = 0, error2 = 0, truth2 = 0;
    for (size_t i = 0; i < pixels; ++i)
      if (inside[i] != 0) n += 1, mean += truth[i];
    mean /= n;
    for (size_t i = 0; i < pixels; ++i) {
      if (inside[i] == 0) continue;
      error2 += std::pow(depth[i] - (truth[i] - mean), 2);
      truth2 += std::pow(truth[i] - mean, 2);
    }
    return std::sqrt(error2 / truth2);
  }
  double depth_error(const PhotometricCalibration& calibration, const char* shape) {
    double square = 0;
    const Contacts all = contacts(shape);
    for (const FoundBall& contact : all) square += std::pow(depth_error(calibration, shape, contact), 2);
    return std::sqrt(square / static_cast<double>(all.size()));
  }

  fs::path folder_;
  ShapePictures pictures_;
  RunWatch watch_;
};

TEST_F(Shapes, EachAloneReadsTheDepthOfTheOthers) {
  const std::vector<const char*> shapes{kBall, kCylinder, kCone};
  for (const char* by : shapes) {
    const Sensor sensor = calibrated(save(by), {by}).sensor;
    for (const char* judged : shapes) {
      const double error = depth_error(sensor.photometric, judged);
      std::printf("by %-36s %-36s read to %.1f %% of its depth\n", by, judged, 100 * error);
      EXPECT_LT(error, 0.05) << by << " judged on " << judged;
    }
  }
}

TEST_F(Shapes, CylindersAndConesAreFoundWhereTheyAre) {
  for (const char* shape : {kCylinder, kCone}) {
    const Contacts truth = contacts(shape);
    const BallPresses presses = found(save(shape), parse_shape(shape));
    ASSERT_EQ(presses.presses.size(), truth.size()) << shape;
    for (size_t i = 0; i < truth.size(); ++i) {
      const FoundBall &is = presses.presses[i].ball, &was = truth[i];
      const double apart = std::remainder(is.axis_rad - was.axis_rad, std::numbers::pi);
      const MiddleOffset off = offset_from(was, is.center_x_px, is.center_y_px);
      std::printf(
          "%s %zu: middle off by %.2f px, %.2f deg, half width %.1f of %.1f, half length %.1f of %.1f, "
          "%.3f\n",
          shape, i, off.px, apart * 180 / std::numbers::pi, is.radius_px, was.radius_px, is.half_length_px,
          was.half_length_px, is.explained);
      EXPECT_LT(off.px, 0.4) << shape << " " << i;
      EXPECT_NEAR(is.radius_px, was.radius_px, 0.12 * was.radius_px) << shape << " " << i;
      EXPECT_NEAR(is.half_length_px, was.half_length_px, 5) << shape << " " << i;
      if (was.half_length_px > 0) {
        EXPECT_LT(std::abs(apart), 0.02) << shape << " " << i;
      }
    }
  }
}

TEST_F(Shapes, ACylinderLongerThanThePictureCountsUpToItsBorder) {
  const BallPresses presses =
      found(save(kCylinder, {contact_at(150, 110, 12, 0.3, 1000)}, "long"), parse_shape(kCylinder));
  ASSERT_EQ(presses.presses.size(), 1u);
  const FoundBall& is = presses.presses[0].ball;
  EXPECT_NEAR(is.axis_rad, 0.3, 0.01);
  EXPECT_GT(is.half_length_px, 150);
  EXPECT_LT(offset_from(contact_at(150, 110, 12, 0.3, 1000), is.center_x_px, is.center_y_px).px, 0.4);
}

TEST_F(Shapes, DotsOfAGridAreBallsOfTheirOwn) {
  constexpr const char* kDots = "dots:radius=1:apart=2.4";
  const PressedShape dot = PressedShape::ball(1);
  for (int picture = 0; picture < 3; ++picture) {
    std::vector<PressedPlace> places;
    places.reserve(12);
    for (int i = 0; i < 12; ++i)
      places.emplace_back(dot,
                          contact_at(80 + 27.6 * (i % 4) + 20 * picture,
                                     70 + 27.6 * static_cast<int>(i / 4) + 10 * picture, 7.5),
                          ShapePictures::kPitch_mm);
    pictures_.save(folder_ / "dots" / text("%d.png", picture), places);
  }
  const std::string input = (folder_ / "dots").string();
  const BallPresses presses = found(input, parse_shape(kDots));
  EXPECT_EQ(presses.presses.size(), 36u);
  for (const BallPress& press : presses.presses) {
    EXPECT_EQ(press.shape, dot);
    EXPECT_NEAR(press.ball.radius_px, 7.5, 0.9) << press.label;
  }
  const Sensor sensor = calibrated(input, {kDots}).sensor;
  const double error = depth_error(sensor.photometric, kBall, contact_at(140, 110, 20));
  std::printf("by dots a ball is read to %.1f %% of its depth\n", 100 * error);
  EXPECT_LT(error, 0.06);
  EXPECT_FALSE(sensor.skin) << "dots are no printed markers";
  // Another distance than the grid's.
  EXPECT_THROW(found(input, parse_shape("dots:radius=1:apart=1.2")), Error);
}

TEST_F(Shapes, BallsAndCylindersJudgeEachOther) {
  const std::string balls = save(kBall), cylinders = save(kCylinder);
  const CalibrationReport both = calibrated(balls, {kBall, cylinders + "=" + kCylinder});
  EXPECT_EQ(both.json.at("presses").size(), 18u);
  EXPECT_TRUE(both.json.at("models").at(0).contains("ball_held_out")) << both.text;
  EXPECT_TRUE(both.json.at("shapes").is_array());
  EXPECT_EQ(both.json.at("doubt").text(), "");
  EXPECT_LT(depth_error(both.sensor.photometric, kCone), 0.05);
}

TEST_F(Shapes, ATableNamesShapesToo) {
  const std::string cylinders = save(kCylinder);
  const Contacts truth = contacts(kCylinder);
  const auto write = [&](const std::string& header, const auto& row) {
    std::ofstream table(folder_ / "presses.csv");
    table << header << "\n";
    for (size_t i = 0; i < truth.size(); ++i) table << text("%02zu.png,", i) << row(truth[i]) << "\n";
  };
  PhotometricRequest by_table = request(cylinders, {});
  by_table.balls = folder_ / "presses.csv";
  const auto read = [&] { return calibrate_photometric(by_table, {{}, watch_}).sensor; };
  const std::string header = "image,center_x_px,center_y_px,contact_radius_px,shape,axis_deg,length_px";
  const auto place = [](const FoundBall& c) {
    return text("%.2f,%.2f,%.2f,", c.center_x_px, c.center_y_px, c.radius_px);
  };
  const auto lies = [](const FoundBall& c) {
    return text(",%.2f,%.2f", c.axis_rad * 180 / std::numbers::pi, 2 * c.half_length_px);
  };
  write(header, [&](const FoundBall& c) { return place(c) + kCylinder + lies(c); });
  EXPECT_LT(depth_error(read().photometric, kBall), 0.05);
  const auto refused = [&](const char* says) {
    try {
      read();
      ADD_FAILURE() << "not refused: " << says;
    } catch (const Error& error) {
      EXPECT_EQ(error.failure(), Failure::Input);
      EXPECT_NE(std::string(error.what()).find(says), std::string::npos) << error.what();
    }
  };
  write(header, [&](const FoundBall& c) { return place(c) + "cylinder:2" + lies(c); });
  refused("by name");
  write(header, [&](const FoundBall& c) { return place(c) + kCylinder + ",10,"; });
  refused("length_px");
  write(header, [&](const FoundBall& c) { return place(c) + kCylinder + ",10,12"; });
  refused("longer than wide");
  write(header, [&](const FoundBall& c) { return place(c) + "dots:radius=1:apart=2" + lies(c); });
  refused("a row for each dot");
  write(header, [&](const FoundBall& c) { return place(c) + lies(c); });
  refused("ball_radius_mm");
}

TEST_F(Shapes, WrongShapesSizesAndDirectionsAreNamed) {
  const std::string cylinders = save(kCylinder), balls = save(kBall);
  // The radius for the diameter: as of balls, the shading tells.
  EXPECT_NE(calibrated(cylinders, {"cylinder:radius=4"}).json.at("doubt").text().find("diameter"),
            std::string::npos);
  EXPECT_EQ(calibrated(cylinders, {"cylinder:diameter=4"}).json.at("doubt").text(), "");
  const auto refused = [&](const std::string& input, const char* shape, const char* says) {
    try {
      const CalibrationReport report = calibrated(input, {shape});
      ADD_FAILURE() << "not refused: " << shape << " of " << input << "\n" << report.text;
    } catch (const Error& error) {
      EXPECT_EQ(error.failure(), Failure::Input);
      EXPECT_NE(std::string(error.what()).find(says), std::string::npos) << error.what();
    }
  };
  refused(cylinders, "cylinder:radius=0.7", "wider than the cylinder");
  refused(balls, kCylinder, "as long as wide");
  refused(balls, "cone:half-angle=45", "a ball explains");
  Contacts alike = contacts(kCylinder);
  for (FoundBall& contact : alike) contact.axis_rad = 0.2;
  refused(save(kCylinder, alike, "alike"), kCylinder, "lie alike");
}

TEST(ShapeText, IsReadByNameOrRefused) {
  EXPECT_EQ(parse_shape("cylinder:diameter=5"), (PressedShape{PressedShape::Kind::Cylinder, 2.5}));
  EXPECT_EQ(parse_shape("cone:angle=120:tip-radius=0.2"), (PressedShape{PressedShape::Kind::Cone, 0.2, 60}));
  EXPECT_EQ(parse_shape("dots:radius=0.5:apart=2"), (PressedShape{PressedShape::Kind::Ball, 0.5, 90, 2}));
  const ShapedRecording other = parse_shaped_recording("a=b/pins=cylinder:radius=2");
  EXPECT_EQ(other.recording, "a=b/pins");
  EXPECT_EQ(other.shape, parse_shape("cylinder:radius=2"));
  EXPECT_FALSE(parse_shaped_recording("cone:half-angle=60").recording);
  for (const char* wrong : {"",
                            "cylinder",
                            "cylinder:2",
                            "cylinder:radius",
                            "cylinder:radius=",
                            "cylinder:radius=2mm",
                            "cylinder:radius=-2",
                            "cylinder:radius=nan",
                            "cylinder:radius=1e9",
                            "cylinder:radius=2:diameter=4",
                            "cylinder:half-angle=3",
                            "cone:radius=2",
                            "cone:tip-radius=1",
                            "cone:half-angle=120",
                            "cone:half-angle=60:angle=120",
                            "dots:radius=1",
                            "dots:radius=2:apart=1",
                            "ball:radius=1:apart=2",
                            "cube:radius=2",
                            "pins=",
                            "pins=cylinder:2"})
    EXPECT_THROW(parse_shaped_recording(wrong), Error) << wrong;
}

}  // namespace
}  // namespace palpate

// A camera's settings on the command line, composed into the text that opens it.
#include "viz/commands/option_groups/camera_options.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "palpate/error.h"
#include "viz/commands/support/options.h"

namespace palpate {
namespace {

/// Name of the source as composed from the command line.
std::string composed(const std::vector<std::string>& arguments) {
  CommandLine command;
  CameraChoice choice;
  std::string input = "synthetic:palpation";
  command.add_option("INPUT", input);
  choice.add_to(command);
  const Parsed parsed = command.parse(arguments);
  EXPECT_TRUE(parsed.done) << parsed.text;
  return choice.input(input);
}

TEST(CameraOptions, TheCommandLineBecomesOneText) {
  EXPECT_EQ(composed({}), "synthetic:palpation");
  EXPECT_EQ(composed({"film.avi"}), "film.avi");
  EXPECT_EQ(composed({"--camera", "0"}), "camera:0");
  EXPECT_EQ(composed({"--camera",
                      "/dev/video0",
                      "--format",
                      "Y16",
                      "--size",
                      "1392x1042",
                      "--fps",
                      "15",
                      "--exposure",
                      "8ms",
                      "--gain",
                      "3",
                      "--white-balance",
                      "auto",
                      "--control",
                      "focus=3",
                      "--control",
                      "zoom=1",
                      "--camera-timeout",
                      "3s",
                      "--camera-buffers",
                      "4"}),
            "camera:/dev/"
            "video0?format=Y16&size=1392x1042&fps=15&exposure=0.008s&gain=3&white_balance=auto&timeout=3s&"
            "buffers=4&control.focus=3&control.zoom=1");
  EXPECT_THROW(composed({"film.avi", "--camera", "0"}), Error);
  EXPECT_THROW(composed({"--format", "Y16"}), Error);
  EXPECT_THROW(composed({"--camera", "0", "--exposure", "8"}), Error);
  EXPECT_THROW(composed({"--camera", "0", "--control", "focus"}), Error);
}

}  // namespace
}  // namespace palpate

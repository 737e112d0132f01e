// Errors of the program and the files it leaves: one line, a documented exit code, whole files.
#include "tests/support/eventually.h"
#include "tests/support/json.h"
#include "tests/support/program_fixture.h"

#include <cmath>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/videoio.hpp>

#include "capture/files/npy.h"
#include "engine/base/text.h"
#include "tests/scenes/dent.h"

namespace palpate {
namespace {

TEST_F(Program, UsageErrorsAreOneLine) {
  // With a display there is the list of sources.
  expect_refusal({}, 2, {"no command was given", "DISPLAY"},
                 {.environment = {{"DISPLAY", ""}, {"WAYLAND_DISPLAY", ""}}});
  expect_refusal({"fly"}, 2, {"fly"});
  // The system's words, as they stand within a sentence.
  expect_refusal({"process", "synthetic:press", "--out", "/dev/null/folder"}, 7, {"found not a directory"});
  expect_refusal({"process"}, 2, {"--out"});
  expect_refusal({"process", "--out", folder_ / "out"}, 2, {"input", "--camera"});
  expect_refusal({"process", "a.avi", "--out", folder_, "--solver", "magic"}, 2, {"solver", "magic"});
  expect_refusal({"process", "a.avi", "--out", folder_, "--depth", "jpeg"}, 2, {"depth", "jpeg"});
  expect_refusal({"devices", "--colour"}, 2, {"--colour"});
  expect_refusal({"simulate", "palpation", "--out", folder_ / "x", "--size", "0x0"}, 2, {"size"});
  expect_refusal({"simulate", "palpation", "--out", folder_ / "x", "--size", "999999x4"}, 2, {"size"});
  expect_refusal({"simulate", "palpation", "--out", folder_ / "x", "--bits", "7"}, 2, {"bits"});
  expect_refusal({"simulate", "nonsense", "--out", folder_ / "x"}, 3, {"nonsense"});
}

TEST_F(Program, FailuresAreJsonToo) {
  const Ended ended = run(
      {"process", folder_ / "none.avi", "--sensor", folder_ / "none.json", "--out", folder_ / "o", "--json"});
  EXPECT_EQ(ended.exit_code, 4);
  const Json value = parse_json(ended.out);
  EXPECT_EQ(value.at("exit_code"), 4);
  EXPECT_FALSE(value.at("complete").get<bool>());
  EXPECT_TRUE(contains(value.at("error").get<std::string>(), "none.json"));
}

TEST_F(Program, NoDeviceIsToldApart) {
  const fs::path rec = recording(3);
  const Surroundings none{
      .environment = {{"VK_ICD_FILENAMES", "/nonexistent.json"}, {"VK_DRIVER_FILES", "/nonexistent.json"}}};
  const Ended listed = run({"devices", "--json"}, none);
  EXPECT_EQ(listed.exit_code, 5);
  EXPECT_FALSE(parse_json(listed.out).at("usable").get<bool>());
  expect_refusal({"process", rec / "frames", "--sensor", rec / "sensor.json", "--out", folder_ / "o"}, 5,
                 {"Vulkan"}, none);
  expect_refusal({"process", rec / "frames", "--sensor", rec / "sensor.json", "--out", folder_ / "o",
                  "--device", "nosuchdevice"},
                 5, {"nosuchdevice"});
  EXPECT_FALSE(fs::exists(folder_ / "o" / "measurements.csv"));
}

TEST_F(Program, LiveWithoutDisplaySaysSo) {
  const Surroundings dark{.environment = {{"DISPLAY", ""}, {"WAYLAND_DISPLAY", ""}}};
  expect_refusal({"live"}, 6, {"display"}, dark);
}

TEST_F(Program, BadGradientsAreRefused) {
  const auto refuse = [&](const std::string& name, const std::string& bytes,
                          const std::vector<std::string>& words) {
    spill(folder_ / name, bytes);
    expect_refusal({"integrate", folder_ / name, "--out", folder_ / "o"}, 3, words);
    EXPECT_FALSE(fs::exists(folder_ / "o" / "height.npy")) << name;
  };
  const auto array = [](const std::string& dictionary, size_t bytes) {
    std::string header = dictionary + "\n";
    std::string file("\x93NUMPY\x01\x00", 8);
    file += static_cast<char>(header.size() & 255);
    file += static_cast<char>(header.size() >> 8);
    return file + header + std::string(bytes, '\0');
  };
  refuse("empty.npy", "", {"empty file"});
  refuse("text.npy", "hello, I am no array", {"signature"});
  refuse("short.npy", std::string("\x93NUMPY\x01\x00\xff", 9), {"ends inside its header"});
  refuse("fortran.npy", array("{'descr': '<f4', 'fortran_order': True, 'shape': (4, 4, 2), }", 128),
         {"Fortran"});
  refuse("int.npy", array("{'descr': '<i4', 'fortran_order': False, 'shape': (4, 4, 2), }", 128), {"<i4"});
  refuse("big-endian.npy", array("{'descr': '>f4', 'fortran_order': False, 'shape': (4, 4, 2), }", 128),
         {">f4"});
  refuse("record.npy", array("{'descr': [('a', '<f4')], 'fortran_order': False, 'shape': (4, 4, 2), }", 128),
         {"[('a', '<f4')]"});
  refuse("lie.npy", array("{'descr': '<f4', 'fortran_order': False, 'shape': (4, 5, 2), }", 128),
         {"160", "128"});
  refuse("huge.npy",
         array("{'descr': '<f4', 'fortran_order': False, 'shape': (4000000000, 4000000000, 2), }", 128),
         {"4000000000"});
  refuse("overflow.npy",
         array("{'descr': '<f4', 'fortran_order': False, 'shape': (99999999999999999999999, 2, 2), }", 128),
         {"NumPy"});
  refuse("zero.npy", array("{'descr': '<f4', 'fortran_order': False, 'shape': (0, 4, 2), }", 0),
         {"0 x 4 x 2"});
  refuse("flat.npy", array("{'descr': '<f4', 'fortran_order': False, 'shape': (4, 4), }", 64), {"4 x 4"});
  refuse("three.npy", array("{'descr': '<f4', 'fortran_order': False, 'shape': (4, 4, 3), }", 192),
         {"4 x 4 x 3"});
  refuse("wide.npy", array("{'descr': '<f4', 'fortran_order': False, 'shape': (1, 20000, 2), }", 160000),
         {"1 x 20000 x 2"});
  refuse("key.npy", array("{'descr': '<f4', 'fortran_order': False, 'shape': (4, 4, 2), 'more': 1}", 128),
         {"NumPy"});

  NpyArray slopes = gaussian_slopes(20, 30, 4, 1);
  slopes.values[2 * (7 * 30 + 11) + 1] = std::nanf("");
  write_npy(folder_ / "nan.npy", slopes.values, slopes.shape);
  expect_refusal({"integrate", folder_ / "nan.npy", "--out", folder_ / "o"}, 3,
                 {"row 7", "column 11", "dz/dy"});
  expect_refusal({"integrate", folder_ / "nowhere.npy", "--out", folder_ / "o"}, 3, {"no such file"});
  expect_refusal({"integrate", folder_, "--out", folder_ / "o"}, 3, {"not a file"});
}

TEST_F(Program, ATruncatedVideoIsMeasuredToItsEndAndTold) {
  const fs::path rec = recording(40), film = folder_ / "film.avi", cut = folder_ / "cut.avi";
  cv::VideoWriter writer;
  for (int i = 0; i < 40; ++i) {
    const cv::Mat image = cv::imread((rec / "frames" / palpate::text("%06d.png", i)).string());
    if (i == 0) {
      ASSERT_TRUE(writer.open(film.string(), cv::VideoWriter::fourcc('M', 'J', 'P', 'G'), 30, image.size()));
    }
    writer.write(image);
  }
  writer.release();
  const std::vector<std::string> whole = {"process",           film,    "--sensor",
                                          rec / "sensor.json", "--out", folder_ / "whole"};
  ASSERT_EQ(run(whole).exit_code, 0);
  const std::string bytes = slurp(film);
  spill(cut, bytes.substr(0, bytes.size() / 2));
  const std::vector<std::string> process = {"process",           cut,     "--sensor",
                                            rec / "sensor.json", "--out", folder_ / "out"};
  expect_refusal(process, 3, {"40 frames", "which are measured", "cut short"});
  const size_t rows = Table(slurp(folder_ / "out/measurements.csv")).rows.size();
  EXPECT_GT(rows, 10u);
  EXPECT_LT(rows, 30u);
  const Json summary = parse_json(slurp(folder_ / "out/summary.json"));
  EXPECT_EQ(summary["complete"], false);
  EXPECT_EQ(summary["frames"], rows);
  EXPECT_NE(summary["ended_by"].get<std::string>().find("40 frames"), std::string::npos);
  // Not where its end was not asked for.
  std::vector<std::string> some = process;
  some.insert(some.end(), {"--frames", "5"});
  EXPECT_EQ(run(some).exit_code, 0);
}

TEST_F(Program, BadRecordingsAreRefused) {
  const fs::path rec = recording(3);
  const std::string sensor = rec / "sensor.json";
  const auto refuse = [&](const fs::path& input) {
    SCOPED_TRACE(input);
    expect_refusal({"process", input, "--sensor", sensor, "--out", folder_ / "o"}, 3, {input.filename()});
    EXPECT_FALSE(fs::exists(folder_ / "o" / "summary.json"));
  };
  refuse(folder_ / "missing.avi");
  spill(folder_ / "empty.avi", "");
  refuse(folder_ / "empty.avi");
  spill(folder_ / "text.avi", "this is not a video\n");
  refuse(folder_ / "text.avi");
  const std::string image = slurp(rec / "frames" / "000000.png");
  spill(folder_ / "cut.png", image.substr(0, image.size() / 2));
  refuse(folder_ / "cut.png");
  fs::create_directories(folder_ / "nothing");
  refuse(folder_ / "nothing");
  refuse("/dev/null");
}

TEST_F(Program, FrameThatChangesSizeEndsTheRecording) {
  const fs::path rec = recording(6);
  const fs::path other = folder_ / "other";
  ASSERT_EQ(run({"simulate", "palpation", "--out", other, "--size", "80x64", "--frames", "1"}).exit_code, 0);
  fs::copy_file(other / "frames" / "000000.png", rec / "frames" / "000004.png",
                fs::copy_options::overwrite_existing);
  const fs::path out = folder_ / "out";
  expect_refusal(
      {"process", rec / "frames", "--sensor", rec / "sensor.json", "--out", out, "--outputs", "force"}, 3,
      {"000004.png"});
  const Table table(slurp(out / "measurements.csv"));
  table.expect_whole();
  EXPECT_EQ(table.rows.size(), 4u) << "the frames before it are kept";
  EXPECT_FALSE(parse_json(slurp(out / "summary.json")).at("complete").get<bool>());
}

TEST_F(Program, BadSensorFilesAreRefused) {
  const fs::path rec = recording(2);
  const Json good = parse_json(slurp(rec / "sensor.json"));
  const auto refuse = [&](const std::string& text, const std::vector<std::string>& words) {
    spill(folder_ / "sensor.json", text);
    expect_refusal({"process", rec / "frames", "--sensor", folder_ / "sensor.json", "--out", folder_ / "o"},
                   4, words);
    EXPECT_FALSE(fs::exists(folder_ / "o" / "measurements.csv"));
  };
  refuse("", {"sensor.json"});
  refuse("{", {"sensor.json"});
  refuse("[1, 2]", {"sensor.json"});
  Json bad = good;
  bad["pitch_mm_per_px"] = "wide";
  refuse(bad.dump(), {"pitch_mm_per_px"});
  bad["pitch_mm_per_px"] = -1;
  refuse(bad.dump(), {"pitch_mm_per_px"});
  bad = good;
  bad["pitchmm"] = 3;
  refuse(bad.dump(), {"pitchmm"});
  bad = good;
  bad["frame"]["bit_depth"] = 99;
  refuse(bad.dump(), {"bit_depth"});
  expect_refusal({"process", rec / "frames", "--sensor", folder_ / "nosensor.json", "--out", folder_ / "o"},
                 4, {"nosensor.json"});
}

TEST_F(Program, UnwritableFoldersAreRefused) {
  const fs::path rec = recording(2);
  spill(folder_ / "file", "");
  const std::string below = folder_ / "file" / "out";
  expect_refusal({"process", rec / "frames", "--sensor", rec / "sensor.json", "--out", below}, 7, {"file"});
  expect_refusal({"simulate", "palpation", "--out", below, "--size", "64x48", "--frames", "1"}, 7, {"file"});
  expect_refusal({"devices", "--out", below}, 7, {"file"});
  const NpyArray slopes = gaussian_slopes(20, 30, 4, 1);
  write_npy(folder_ / "slopes.npy", slopes.values, slopes.shape);
  expect_refusal({"integrate", folder_ / "slopes.npy", "--out", below}, 7, {"file"});
  expect_refusal({"process", rec / "frames", "--sensor", rec / "sensor.json", "--out", "/proc/palpate"}, 7,
                 {"/proc/palpate"});
}

TEST_F(Program, FullDiskLeavesOnlyWholeRows) {
  const fs::path rec = recording(40), out = folder_ / "out";
  constexpr rlim_t kLimit_bytes = 3000;  // some rows fit, forty do not
  expect_refusal(
      {"process", rec / "frames", "--sensor", rec / "sensor.json", "--out", out, "--outputs", "force"}, 7,
      {"measurements.csv"}, {.largest_file_bytes = kLimit_bytes});
  const std::string text = slurp(out / "measurements.csv");
  EXPECT_LE(text.size(), kLimit_bytes);
  ASSERT_FALSE(text.empty());
  EXPECT_EQ(text.back(), '\n');
  const Table table(text);
  table.expect_whole();
  EXPECT_GT(table.rows.size(), 2u);
  EXPECT_LT(table.rows.size(), 40u);
  EXPECT_FALSE(fs::exists(out / "summary.json"));
}

TEST_F(Program, FullDiskLeavesNoHalfArray) {
  const NpyArray slopes = gaussian_slopes(97, 71, 9, 12);
  write_npy(folder_ / "slopes.npy", slopes.values, slopes.shape);
  expect_refusal({"integrate", folder_ / "slopes.npy", "--out", folder_ / "out"}, 7, {"height.npy"},
                 {.largest_file_bytes = 4096});
  EXPECT_TRUE(fs::is_empty(folder_ / "out"));
}

TEST_F(Program, FullStdoutIsAnError) {
  const Ended ended = run({"devices"}, {.stdout_file = "/dev/full"});
  EXPECT_EQ(ended.exit_code, 7);
  EXPECT_TRUE(contains(ended.err, "stdout")) << ended.err;
}

TEST_F(Program, InterruptKeepsWhatWasWritten) {
  const fs::path out = folder_ / "out";
  const pid_t child = start({"process", "synthetic:palpation", "--out", out, "--outputs", "force", "--json"});
  const fs::path file = out / "measurements.csv";
  const auto rows_so_far = [&] {
    const std::string text = slurp(file);
    return std::count(text.begin(), text.end(), '\n');
  };
  ASSERT_TRUE(eventually([&] { return rows_so_far() >= 4; }));
  ASSERT_EQ(kill(child, SIGINT), 0);
  const Ended ended = finish(child);
  EXPECT_EQ(ended.exit_code, 130) << ended.err;
  const Json summary = parse_json(ended.out);
  EXPECT_FALSE(summary.at("complete").get<bool>());
  EXPECT_EQ(parse_json(slurp(out / "summary.json")), summary);
  const Table table(slurp(file));
  table.expect_whole();
  EXPECT_EQ(table.rows.size(), summary.at("frames").get<size_t>());
  EXPECT_GE(table.rows.size(), 3u);
}

}  // namespace
}  // namespace palpate

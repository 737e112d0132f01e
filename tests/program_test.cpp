// The program as its user meets it: run as a process, judged by exit code, stdout, stderr and the files it
// leaves.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include "viz/npy.h"

namespace palpate {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

std::string slurp(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

void spill(const fs::path& file, const std::string& text) {
  std::ofstream(file, std::ios::binary) << text;
}

bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

struct Ended {
  int exit_code = -1;  ///< 1000 + signal where a signal killed it
  std::string out;
  std::string err;
};

struct Surroundings {
  std::map<std::string, std::string> environment = {};  ///< set on top of ours; an empty value unsets
  rlim_t largest_file_bytes = RLIM_INFINITY;
  std::string stdout_file = {};  ///< where stdout goes instead of a captured file
};

/// A folder of its own for each test.
class Program : public testing::Test {
 protected:
  void SetUp() override {
    const auto* info = testing::UnitTest::GetInstance()->current_test_info();
    folder_ =
        fs::temp_directory_path() / ("palpate-program-" + std::to_string(getpid()) + "-" + info->name());
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  void TearDown() override {
    if (!HasFailure()) fs::remove_all(folder_);
  }

  pid_t start(const std::vector<std::string>& arguments, const Surroundings& around = {}) {
    const std::string out = around.stdout_file.empty() ? (folder_ / "stdout").string() : around.stdout_file;
    const std::string err = (folder_ / "stderr").string();
    std::vector<char*> argv;
    std::string program = PALPATE_PROGRAM;
    argv.push_back(program.data());
    std::vector<std::string> copies = arguments;
    for (std::string& a : copies) argv.push_back(a.data());
    argv.push_back(nullptr);
    const pid_t child = fork();
    if (child == 0) {
      for (const auto& [name, value] : around.environment) {
        value.empty() ? unsetenv(name.c_str()) : setenv(name.c_str(), value.c_str(), 1);
      }
      const int out_file = open(out.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0666);
      const int err_file = open(err.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0666);
      dup2(out_file, STDOUT_FILENO);
      dup2(err_file, STDERR_FILENO);
      if (around.largest_file_bytes != RLIM_INFINITY) {
        const rlimit limit{around.largest_file_bytes, around.largest_file_bytes};
        setrlimit(RLIMIT_FSIZE, &limit);
      }
      execv(argv[0], argv.data());
      _exit(127);
    }
    return child;
  }

  Ended finish(pid_t child) {
    int status = 0;
    waitpid(child, &status, 0);
    Ended ended;
    ended.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : 1000 + WTERMSIG(status);
    ended.out = slurp(folder_ / "stdout");
    ended.err = slurp(folder_ / "stderr");
    return ended;
  }

  Ended run(const std::vector<std::string>& arguments, const Surroundings& around = {}) {
    return finish(start(arguments, around));
  }

  /// Fails with exactly this code, one line on stderr that begins with the program's name and holds each of
  /// `words`.
  void expect_refusal(const std::vector<std::string>& arguments, int exit_code,
                      const std::vector<std::string>& words, const Surroundings& around = {}) {
    const Ended ended = run(arguments, around);
    EXPECT_EQ(ended.exit_code, exit_code) << ended.err;
    EXPECT_EQ(ended.out, "");
    std::string line;
    std::istringstream lines(ended.err);
    int refusals = 0;
    std::string refusal;
    while (std::getline(lines, line)) {
      EXPECT_EQ(line.rfind("palpate: ", 0), 0u) << "not ours: " << line;
      if (line.rfind("palpate: device", 0) == 0) continue;  // the log says which device was chosen
      refusal = line;
      ++refusals;
    }
    EXPECT_EQ(refusals, 1) << ended.err;
    for (const std::string& word : words)
      EXPECT_TRUE(contains(refusal, word)) << refusal << " lacks " << word;
  }

  /// A small recording with its sensor file in folder_/rec.
  fs::path recording(int frames = 30) {
    const fs::path rec = folder_ / "rec";
    const Ended ended =
        run({"simulate", "palpation", "--out", rec, "--size", "160x120", "--frames", std::to_string(frames)});
    EXPECT_EQ(ended.exit_code, 0) << ended.err;
    return rec;
  }

  fs::path folder_;
};

struct Table {
  std::vector<std::string> columns;
  std::vector<std::vector<std::string>> rows;

  explicit Table(const std::string& text) {
    std::istringstream lines(text);
    std::string line;
    while (std::getline(lines, line)) {
      std::vector<std::string> cells(1);
      for (const char c : line) {
        if (c == ',') {
          cells.emplace_back();
        } else {
          cells.back() += c;
        }
      }
      if (columns.empty()) {
        columns = cells;
      } else {
        rows.push_back(cells);
      }
    }
  }
  const std::string& at(size_t row, const std::string& column) const {
    static const std::string none = "no such column";
    for (size_t i = 0; i < columns.size(); ++i) {
      if (columns[i] == column) return rows.at(row).at(i);
    }
    ADD_FAILURE() << none << ": " << column;
    return none;
  }
  void expect_whole() const {
    for (const auto& row : rows) EXPECT_EQ(row.size(), columns.size());
  }
};

const std::vector<std::string> kCommands = {"live", "process", "simulate", "integrate", "devices", "demo"};

TEST_F(Program, EveryCommandExplainsItself) {
  for (const std::string& command : kCommands) {
    const Ended ended = run({command, "--help"});
    EXPECT_EQ(ended.exit_code, 0) << command;
    EXPECT_EQ(ended.err, "") << command;
    for (const char* part :
         {"Examples:", "Exit codes:", "--json", "--out", "--device", "--seed", "--quiet", "--validation"}) {
      EXPECT_TRUE(contains(ended.out, part)) << command << " lacks " << part;
    }
    EXPECT_TRUE(contains(ended.out, "palpate " + command)) << command << " has no example of itself";
  }
  const Ended ended = run({"--help"});
  EXPECT_EQ(ended.exit_code, 0);
  for (const std::string& command : kCommands) EXPECT_TRUE(contains(ended.out, command));
}

TEST_F(Program, UsageErrorsAreOneLine) {
  expect_refusal({}, 2, {"subcommand"});
  expect_refusal({"fly"}, 2, {"fly"});
  expect_refusal({"process"}, 2, {"INPUT"});
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
  const Json value = Json::parse(ended.out);
  EXPECT_EQ(value.at("exit_code"), 4);
  EXPECT_FALSE(value.at("complete").get<bool>());
  EXPECT_TRUE(contains(value.at("error").get<std::string>(), "none.json"));
}

TEST_F(Program, DevicesAreListed) {
  const Ended ended = run({"devices", "--json", "--out", folder_});
  ASSERT_EQ(ended.exit_code, 0) << ended.err;
  const Json value = Json::parse(ended.out);
  EXPECT_GE(value.at("devices").size(), 1u);
  EXPECT_TRUE(value.at("usable").get<bool>());
  for (const char* key :
       {"index", "name", "type", "driver", "api_version", "memory_bytes", "usable", "refusals"}) {
    EXPECT_TRUE(value.at("devices")[0].contains(key)) << key;
  }
  EXPECT_EQ(Json::parse(slurp(folder_ / "devices.json")), value);
}

TEST_F(Program, NoDeviceIsToldApart) {
  const fs::path rec = recording(3);
  const Surroundings none{
      .environment = {{"VK_ICD_FILENAMES", "/nonexistent.json"}, {"VK_DRIVER_FILES", "/nonexistent.json"}}};
  const Ended listed = run({"devices", "--json"}, none);
  EXPECT_EQ(listed.exit_code, 5);
  EXPECT_FALSE(Json::parse(listed.out).at("usable").get<bool>());
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

TEST_F(Program, SimulatedRecordingComesBackAsMeasurements) {
  constexpr int kFrames = 40;
  const fs::path rec = recording(kFrames);
  const Table truth(slurp(rec / "truth.csv"));
  ASSERT_EQ(truth.rows.size(), size_t{kFrames});
  truth.expect_whole();
  size_t images = 0;
  for (const auto& entry : fs::directory_iterator(rec / "frames"))
    images += entry.path().extension() == ".png";
  EXPECT_EQ(images, size_t{kFrames});
  EXPECT_TRUE(fs::exists(rec / "background.png"));

  const fs::path out = folder_ / "out";
  const Ended ended = run({"process", rec / "frames", "--sensor", rec / "sensor.json", "--out", out,
                           "--outputs", "force", "--rate", "4", "--json", "--validation"});
  ASSERT_EQ(ended.exit_code, 0) << ended.err;
  const Json summary = Json::parse(ended.out);
  EXPECT_EQ(summary.at("frames"), kFrames);
  EXPECT_TRUE(summary.at("complete").get<bool>());
  EXPECT_EQ(Json::parse(slurp(out / "summary.json")), summary);

  const Table table(slurp(out / "measurements.csv"));
  table.expect_whole();
  ASSERT_EQ(table.rows.size(), size_t{kFrames});
  for (const char* column : {"frame", "time_s", "gray_sum", "force_N", "centroid_x_px", "centroid_y_px",
                             "area_px", "saturated_px"}) {
    table.at(0, column);
  }
  size_t touching = 0, together = 0;
  for (size_t i = 0; i < table.rows.size(); ++i) {
    EXPECT_EQ(table.at(i, "frame"), std::to_string(i));
    EXPECT_EQ(std::stod(table.at(i, "time_s")), static_cast<double>(i) / 4);
    const bool contact = table.at(i, "contact") == "1";
    EXPECT_EQ(table.at(i, "centroid_x_px").empty(), !contact) << "row " << i;
    EXPECT_EQ(table.at(i, "ellipse_major_mm").empty(), !contact) << "row " << i;
    EXPECT_EQ(table.at(i, "depth_max_mm"), "") << "not asked for";
    EXPECT_EQ(table.at(i, "gray_sum").find("nan"), std::string::npos);
    touching += contact;
    if (!contact || truth.at(i, "true_contact") != "1") continue;
    ++together;
    EXPECT_NEAR(std::stod(table.at(i, "centroid_x_px")), std::stod(truth.at(i, "true_center_x_px")), 1.0)
        << "row " << i;
    EXPECT_NEAR(std::stod(table.at(i, "centroid_y_px")), std::stod(truth.at(i, "true_center_y_px")), 1.0)
        << "row " << i;
  }
  EXPECT_GT(together, 5u) << "of " << touching << " that touch";
}

TEST_F(Program, SameSeedSameFrames) {
  const fs::path a = folder_ / "a", b = folder_ / "b", c = folder_ / "c";
  for (const auto& [folder, seed] :
       std::vector<std::pair<fs::path, std::string>>{{a, "5"}, {b, "5"}, {c, "6"}}) {
    ASSERT_EQ(
        run({"simulate", "palpation", "--out", folder, "--size", "64x48", "--frames", "2", "--seed", seed})
            .exit_code,
        0);
  }
  EXPECT_EQ(slurp(a / "frames" / "000001.png"), slurp(b / "frames" / "000001.png"));
  EXPECT_NE(slurp(a / "frames" / "000001.png"), slurp(c / "frames" / "000001.png"));
}

TEST_F(Program, DepthFilesAgreeWithEachOther) {
  const fs::path rec = folder_ / "rec", out = folder_ / "out";
  ASSERT_EQ(run({"simulate", "palpation", "--mode", "gel", "--out", rec, "--size", "96x80", "--frames", "8"})
                .exit_code,
            0);
  fs::create_directories(out / "depth");
  spill(out / "depth" / "000900.npy", "left by a longer run");
  const Ended ended = run({"process", rec / "frames", "--sensor", rec / "sensor.json", "--out", out,
                           "--depth", "png16", "--depth", "npy", "--depth", "ply"});
  ASSERT_EQ(ended.exit_code, 0) << ended.err;
  EXPECT_FALSE(fs::exists(out / "depth" / "000900.npy"));
  const NpyArray map = read_npy(out / "depth" / "000007.npy");
  EXPECT_EQ(map.shape, (std::vector<size_t>{80, 96}));
  const std::string ply = slurp(out / "depth" / "000007.ply");
  const size_t body = ply.find("end_header\n") + 11;
  ASSERT_EQ(ply.size() - body, size_t{96} * 80 * 12 + size_t{2} * 95 * 79 * 13);
  for (size_t i = 0; i < map.values.size(); i += 97) {
    float z = 0;
    std::memcpy(&z, ply.data() + body + 12 * i + 8, sizeof z);
    EXPECT_EQ(z, map.values[i]);
  }
  const Json about = Json::parse(slurp(out / "depth" / "depth.json"));
  EXPECT_EQ(about.at("png").at("zero_count"), 8192);
  EXPECT_DOUBLE_EQ(about.at("png").at("step_mm"), 0.0002);
  EXPECT_TRUE(fs::exists(out / "depth" / "000007.png"));
}

/// Slopes of a Gaussian dent per pixel, exact, and its depth.
NpyArray gaussian_slopes(size_t rows, size_t columns, double sigma, double depth) {
  NpyArray slopes{{rows, columns, 2}, {}};
  for (size_t y = 0; y < rows; ++y) {
    for (size_t x = 0; x < columns; ++x) {
      const double dx = static_cast<double>(x) - 30.25, dy = static_cast<double>(y) - 41.5;
      const double z = depth * std::exp(-(dx * dx + dy * dy) / (2 * sigma * sigma));
      slopes.values.push_back(static_cast<float>(-z * dx / (sigma * sigma)));
      slopes.values.push_back(static_cast<float>(-z * dy / (sigma * sigma)));
    }
  }
  return slopes;
}

TEST_F(Program, GradientsBecomeHeights) {
  constexpr size_t kRows = 97, kColumns = 71;
  constexpr double kSigma = 9, kDepth = 12;
  const NpyArray slopes = gaussian_slopes(kRows, kColumns, kSigma, kDepth);
  write_npy(folder_ / "slopes.npy", slopes.values, slopes.shape);
  for (const std::string solver : {"converged", "exact"}) {
    const fs::path out = folder_ / solver;
    const Ended ended = run(
        {"integrate", folder_ / "slopes.npy", "--out", out, "--solver", solver, "--json", "--validation"});
    ASSERT_EQ(ended.exit_code, 0) << ended.err;
    EXPECT_TRUE(Json::parse(ended.out).contains("residual"));
    const NpyArray height = read_npy(out / "height.npy");
    ASSERT_EQ(height.shape, (std::vector<size_t>{kRows, kColumns}));
    const auto [low, high] = std::minmax_element(height.values.begin(), height.values.end());
    double true_low = kDepth, true_high = 0;
    for (size_t y = 0; y < kRows; ++y) {
      for (size_t x = 0; x < kColumns; ++x) {
        const double dx = static_cast<double>(x) - 30.25, dy = static_cast<double>(y) - 41.5;
        const double z = kDepth * std::exp(-(dx * dx + dy * dy) / (2 * kSigma * kSigma));
        true_low = std::min(true_low, z);
        true_high = std::max(true_high, z);
      }
    }
    EXPECT_NEAR(*high - *low, true_high - true_low, 0.001 * kDepth) << solver;
  }
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
  EXPECT_FALSE(Json::parse(slurp(out / "summary.json")).at("complete").get<bool>());
}

TEST_F(Program, BadSensorFilesAreRefused) {
  const fs::path rec = recording(2);
  const Json good = Json::parse(slurp(rec / "sensor.json"));
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
  expect_refusal({"process", rec / "frames", "--out", folder_ / "o"}, 2, {"--sensor"});
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
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(60);
  const auto rows_so_far = [&] {
    const std::string text = slurp(file);
    return std::count(text.begin(), text.end(), '\n');
  };
  while (rows_so_far() < 4 && std::chrono::steady_clock::now() < deadline) {
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  ASSERT_EQ(kill(child, SIGINT), 0);
  const Ended ended = finish(child);
  EXPECT_EQ(ended.exit_code, 130) << ended.err;
  const Json summary = Json::parse(ended.out);
  EXPECT_FALSE(summary.at("complete").get<bool>());
  EXPECT_EQ(Json::parse(slurp(out / "summary.json")), summary);
  const Table table(slurp(file));
  table.expect_whole();
  EXPECT_EQ(table.rows.size(), summary.at("frames").get<size_t>());
  EXPECT_GE(table.rows.size(), 3u);
}

TEST_F(Program, SyntheticInputIsComparedWithItsTruth) {
  const fs::path out = folder_ / "out";
  const Ended ended =
      run({"process", "synthetic:palpation", "--out", out, "--frames", "60", "--json", "--outputs", "force"});
  ASSERT_EQ(ended.exit_code, 0) << ended.err;
  const Json summary = Json::parse(ended.out);
  EXPECT_EQ(summary.at("frames"), 60);
  EXPECT_TRUE(summary.contains("measured_minus_true"));
  const Table table(slurp(out / "measurements.csv"));
  for (const char* column : {"true_force_N", "true_center_x_px", "true_depth_max_mm"}) table.at(0, column);
}

TEST_F(Program, ImagesWithoutRateHaveNoTime) {
  const fs::path rec = recording(2), out = folder_ / "out";
  ASSERT_EQ(run({"process", rec / "frames", "--sensor", rec / "sensor.json", "--out", out}).exit_code, 0);
  EXPECT_EQ(Table(slurp(out / "measurements.csv")).at(1, "time_s"), "");
}

TEST_F(Program, FilmAndPicturesAreWritten) {
  const fs::path out = folder_ / "out";
  const Ended ended = run({"process", "synthetic:press?size=160x120&mode=gel", "--out", out, "--frames", "4",
                           "--pictures", "--video", "--picture-every", "2", "--validation"});
  ASSERT_EQ(ended.exit_code, 0) << ended.err;
  EXPECT_TRUE(fs::exists(out / "pictures" / "000000.png"));
  EXPECT_FALSE(fs::exists(out / "pictures" / "000001.png"));
  EXPECT_TRUE(fs::exists(out / "pictures" / "000002.png"));
  EXPECT_GT(fs::file_size(out / "recording.mp4"), 1000u);
  // A later run without a film does not leave this one beside its own measurements.
  ASSERT_EQ(
      run({"process", "synthetic:press?size=160x120&mode=gel", "--out", out, "--frames", "2"}).exit_code, 0);
  EXPECT_FALSE(fs::exists(out / "recording.mp4"));
}

TEST_F(Program, DemoMeasuresWhatItWasNotCalibratedOn) {
  const fs::path out = folder_ / "out";
  const Ended ended =
      run({"demo", "--headless", "--frames", "70", "--picture-every", "35", "--out", out, "--json"});
  ASSERT_EQ(ended.exit_code, 0) << ended.err;
  const Json value = Json::parse(ended.out);
  const Json& felt = value.at("waveguide").at("measured_minus_true");
  const double full_scale_N = felt.at("force_N").at("full_scale");
  EXPECT_GT(full_scale_N, 0.5);
  EXPECT_LT(felt.at("force_N").at("rms_error").get<double>(), 0.01 * full_scale_N);
  EXPECT_GT(felt.at("force_N").at("rms_error").get<double>(), 0) << "too good to be measured";
  EXPECT_LT(felt.at("center_px").at("rms_error").get<double>(), 0.1);
  const Json& seen = value.at("gel").at("measured_minus_true");
  EXPECT_LT(seen.at("depth_max_mm").at("rms_error").get<double>(),
            0.05 * seen.at("depth_max_mm").at("full_scale").get<double>());
  for (const char* file : {"waveguide.json", "gel.json", "waveguide/measurements.csv", "gel/measurements.csv",
                           "gel/recording.mp4", "gel/pictures/000039.png"}) {
    EXPECT_TRUE(fs::exists(out / file)) << file;
  }
}

}  // namespace
}  // namespace palpate

// Successful runs of the program: files, tables and numbers of each command.
#include "tests/support/json.h"
#include "tests/support/program_fixture.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>
#include <limits>
#include <sstream>

#include "capture/files/npy.h"
#include "engine/base/text.h"
#include "palpate/sensor.h"
#include "tests/scenes/dent.h"

namespace palpate {
namespace {

/// The commands below one, from its whole help.
std::vector<std::string> commands_in(const std::string& help) {
  std::vector<std::string> names;
  std::istringstream lines(help);
  bool listed = false;
  for (std::string line; std::getline(lines, line);) {
    if (line == "Commands:") listed = true;
    if (line.empty()) listed = listed && names.empty();
    if (listed && line.starts_with("  ") && line[2] != ' ')
      names.push_back(line.substr(2, line.find(' ', 2) - 2));
  }
  return names;
}

TEST_F(Program, EveryCommandExplainsItselfInOneLook) {
  std::vector<std::vector<std::string>> commands = {{}};
  for (size_t i = 0; i < commands.size(); ++i) {
    std::vector<std::string> arguments = commands[i];
    std::string name = "palpate";
    for (const std::string& word : arguments) name += " " + word;
    SCOPED_TRACE(name);
    arguments.push_back("--help-all");
    const Ended whole = run(arguments);
    arguments.back() = "--help";
    const Ended brief = run(arguments);
    arguments.pop_back();
    arguments.insert(arguments.begin(), "help");
    EXPECT_EQ(run(arguments).out, brief.out);
    EXPECT_EQ(whole.exit_code, 0);
    EXPECT_EQ(brief.exit_code, 0);
    EXPECT_EQ(whole.err + brief.err, "");
    EXPECT_TRUE(brief.out.starts_with(name + ": ")) << brief.out;
    EXPECT_TRUE(contains(brief.out, "Examples:\n  palpate")) << brief.out;
    EXPECT_TRUE(commands[i].empty() || contains(brief.out, "\n  " + name)) << "no example of itself\n"
                                                                           << brief.out;
    std::istringstream lines(brief.out);
    size_t count = 0;
    for (std::string line; std::getline(lines, line); ++count) EXPECT_LE(line.size(), 100u) << line;
    EXPECT_LE(count, 40u) << brief.out;
    const std::vector<std::string> below = commands_in(whole.out);
    for (const char* part : {"Exit codes:", "--json", "--device", "--seed", "--quiet", "--validation"})
      EXPECT_TRUE(!below.empty() || contains(whole.out, part) ||
                  contains(whole.out, "options are those of palpate"))
          << part;
    for (const std::string& one : below) {
      EXPECT_TRUE(contains(brief.out, "\n  " + one + " ")) << one;
      commands.push_back(commands[i]);
      commands.back().push_back(one);
    }
  }
  EXPECT_GT(commands.size(), 35u);
}

TEST_F(Program, WordsThatAreNearlyRightAreUnderstood) {
  const std::vector<std::pair<std::vector<std::string>, std::string>> cases = {
      {{"proces", "x"}, "did you mean 'process'?"},
      {{"calibrate", "forse", "x"}, "did you mean 'force'?"},
      {{"process", "x", "--out", "o", "--sensr", "s.json"}, "did you mean '--sensor'?"},
      {{"process", "x", "--outpts=o"}, "did you mean '--outputs'?"},
      {{"process", "x", "--out", "o", "--solver", "bets"}, "did you mean 'best'?"},
      {{"help", "simulat"}, "did you mean 'simulate'?"}};
  for (const auto& [arguments, words] : cases) expect_refusal(arguments, 2, {words, "try: palpate"});
  expect_refusal({"process", "synthetic:palpaton", "--out", (folder_ / "o").string()}, 3,
                 {"did you mean 'palpation'?", "palpation, ", ", tissue"});
  expect_refusal({"process", "synthetic:press?nois=off", "--out", (folder_ / "o").string()}, 3,
                 {"did you mean 'noise'?"});
  // A word that resembles none gets no guess.
  for (const std::vector<std::string>& words :
       {std::vector<std::string>{"xylophone"}, {"process", "x", "--out", "o", "--solver", "fine"}}) {
    const Ended far = run(words);
    EXPECT_EQ(far.exit_code, 2);
    EXPECT_FALSE(contains(far.err, "did you mean")) << far.err;
  }
  expect_refusal({"process", "x", "--out", "o", "--frames", "0"}, 2, {"--frames", "at least 1; found 0"});
  EXPECT_TRUE(run({"-V"}).out.starts_with("palpate "));
}

TEST_F(Program, DevicesAreListed) {
  const Ended ended = run({"devices", "--json", "--out", folder_});
  ASSERT_EQ(ended.exit_code, 0) << ended.err;
  const Json value = parse_json(ended.out);
  EXPECT_GE(value.at("devices").size(), 1u);
  EXPECT_TRUE(value.at("usable").get<bool>());
  for (const char* key :
       {"index", "name", "type", "driver", "api_version", "memory_bytes", "usable", "refusals"}) {
    EXPECT_TRUE(value.at("devices")[0].contains(key)) << key;
  }
  EXPECT_EQ(parse_json(slurp(folder_ / "devices.json")), value);
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
  const Json summary = parse_json(ended.out);
  EXPECT_EQ(summary.at("frames"), kFrames);
  EXPECT_TRUE(summary.at("complete").get<bool>());
  EXPECT_EQ(parse_json(slurp(out / "summary.json")), summary);

  const Table table(slurp(out / "measurements.csv"));
  table.expect_whole();
  ASSERT_EQ(table.rows.size(), size_t{kFrames});
  for (const char* column : {"frame", "time_s", "gray_sum", "force_N", "centroid_x_px", "centroid_y_px",
                             "area_px", "saturated_px"}) {
    table.at(0, column);
  }
  EXPECT_EQ(std::ranges::count(table.columns, "depth_max_mm"), 0) << "not asked for";
  size_t touching = 0, together = 0;
  for (size_t i = 0; i < table.rows.size(); ++i) {
    EXPECT_EQ(table.at(i, "frame"), std::to_string(i));
    EXPECT_EQ(std::stod(table.at(i, "time_s")), static_cast<double>(i) / 4);
    const bool contact = table.at(i, "contact") == "1";
    EXPECT_EQ(table.at(i, "centroid_x_px").empty(), !contact) << "row " << i;
    EXPECT_EQ(table.at(i, "ellipse_major_mm").empty(), !contact) << "row " << i;
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
  const Json about = parse_json(slurp(out / "depth" / "depth.json"));
  EXPECT_EQ(about.at("png").at("zero_count"), 8192);
  EXPECT_DOUBLE_EQ(about.at("png").at("step_mm"), 0.0002);
  EXPECT_TRUE(fs::exists(out / "depth" / "000007.png"));
}

TEST_F(Program, GradientsBecomeHeights) {
  constexpr size_t kRows = 97, kColumns = 71;
  constexpr double kSigma = 9, kDepth = 12;
  const NpyArray slopes = gaussian_slopes(kRows, kColumns, kSigma, kDepth);
  write_npy(folder_ / "slopes.npy", slopes.values, slopes.shape);
  for (const std::string solver : {"live", "best"}) {
    const fs::path out = folder_ / solver;
    const Ended ended = run(
        {"integrate", folder_ / "slopes.npy", "--out", out, "--solver", solver, "--json", "--validation"});
    ASSERT_EQ(ended.exit_code, 0) << ended.err;
    const Json report = parse_json(ended.out);
    EXPECT_TRUE(report.contains("residual"));
    // On the processor's own driver the direct solve on the host is best.
    if (solver == "live" || contains(report.at("device").get<std::string>(), "llvmpipe")) {
      EXPECT_EQ(report.at("solved_by"), solver == "live" ? "device" : "host");
    }
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
    EXPECT_NEAR(*high - *low, true_high - true_low, (solver == "live" ? 0.003 : 0.001) * kDepth) << solver;
  }
}

TEST_F(Program, SyntheticInputIsComparedWithItsTruth) {
  const fs::path out = folder_ / "out";
  const Ended ended =
      run({"process", "synthetic:palpation", "--out", out, "--frames", "60", "--json", "--outputs", "force"});
  ASSERT_EQ(ended.exit_code, 0) << ended.err;
  const Json summary = parse_json(ended.out);
  EXPECT_EQ(summary.at("frames"), 60);
  EXPECT_TRUE(summary.contains("measured_minus_true"));
  const Table table(slurp(out / "measurements.csv"));
  for (const char* column : {"true_force_N", "true_center_x_px", "true_depth_max_mm"}) table.at(0, column);
}

TEST_F(Program, ImagesWithoutRateHaveNoTime) {
  const fs::path rec = recording(2), out = folder_ / "out";
  ASSERT_EQ(run({"process", rec / "frames", "--sensor", rec / "sensor.json", "--out", out}).exit_code, 0);
  const Table table(slurp(out / "measurements.csv"));
  EXPECT_EQ(std::ranges::count(table.columns, "time_s"), 0);
}

TEST_F(Program, EachRowNamesItsPicture) {
  const fs::path rec = recording(8);
  const std::vector<std::string> names = {"s_0.25.png", "s_0.5.png", "s 0.75, deep.png", "s_1.0.png"};
  const std::vector<std::string> order = {"s 0.75, deep.png", "s_0.25.png", "s_0.5.png", "s_1.0.png"};
  fs::create_directory(folder_ / "presses");
  for (size_t i = 0; i < names.size(); ++i)
    fs::copy_file(rec / "frames" / palpate::text("%06zu.png", 2 * i), folder_ / "presses" / names[i]);
  const Ended ended =
      run({"process", (folder_ / "presses").string(), "--sensor", (rec / "sensor.json").string(),
           "--background", (rec / "background.png").string(), "--out", (folder_ / "out").string()});
  ASSERT_EQ(ended.exit_code, 0) << ended.err;
  EXPECT_NE(ended.out.find("order of the pictures: s 0.75, deep.png, s_0.25.png, s_0.5.png, s_1.0.png"),
            std::string::npos)
      << ended.out;
  EXPECT_EQ(ended.out.find("none given"), std::string::npos) << ended.out;
  const Table table(slurp(folder_ / "out/measurements.csv"));
  ASSERT_EQ(table.columns[1], "source");
  ASSERT_EQ(table.rows.size(), order.size());
  EXPECT_EQ(table.rows[1][1], "s_0.25.png");
  EXPECT_EQ(table.rows[3][1], "s_1.0.png");
  const Json summary = parse_json(slurp(folder_ / "out/summary.json"));
  EXPECT_EQ(summary["sources"].size(), order.size());
  EXPECT_EQ(summary["sources"][0], order[0]);
  EXPECT_EQ(summary["untouched_image"], "given");
}

TEST_F(Program, TablesHoldWhatTheSensorFillsWithTheDigitsItDeserves) {
  const fs::path out = folder_ / "out";
  ASSERT_EQ(run({"process", "synthetic:rig", "--outputs", "force,contacts", "--frames", "120", "--out", out})
                .exit_code,
            0);
  const Table some(slurp(out / "measurements.csv"));
  for (const char* column :
       {"skin_points", "depth_max_mm", "unknown_px", "light_state", "source", "shift_x_px"})
    EXPECT_EQ(std::ranges::count(some.columns, column), 0) << column;
  for (const char* column :
       {"time_s", "force_N", "shear_x_N", "slip", "area_mm2", "contacts", "true_force_N"})
    EXPECT_EQ(std::ranges::count(some.columns, column), 1) << column;
  ASSERT_EQ(run({"process", "synthetic:rig", "--outputs", "force,contacts", "--frames", "120", "--all-digits",
                 "--out", folder_ / "all"})
                .exit_code,
            0);
  const Table all(slurp(folder_ / "all/measurements.csv"));
  ASSERT_EQ(all.columns, some.columns);
  size_t touched = 0;
  for (size_t i = 0; i < some.rows.size(); ++i) {
    if (some.at(i, "force_N").empty()) continue;
    ++touched;
    // Two digits of the error, and the value to the same place: never off by more than half of it.
    const std::string value = some.at(i, "force_N"), error = some.at(i, "force_sd_N");
    const auto places = [](const std::string& text) { return text.size() - 1 - text.find('.'); };
    EXPECT_EQ(places(value), places(error)) << value << " " << error;
    const size_t first = error.find_first_not_of("0.");
    EXPECT_EQ(error.size() - first, 2u) << error;
    EXPECT_NEAR(some.number(i, "force_N"), all.number(i, "force_N"),
                0.5001 * std::pow(10, -static_cast<double>(places(value))));
  }
  EXPECT_GT(touched, 20u);

  const Table summary(slurp(out / "summary.csv"));
  const Json value = parse_json(slurp(out / "summary.json"));
  EXPECT_EQ(summary.rows.size(), value.at("touches").get<size_t>());
  double largest = 0;
  for (size_t i = 0; i < summary.rows.size(); ++i) {
    largest = std::max(largest, summary.number(i, "largest_force_N"));
    EXPECT_LE(summary.number(i, "first_frame"), summary.number(i, "peak_frame"));
    EXPECT_LE(summary.number(i, "peak_frame"), summary.number(i, "last_frame"));
    EXPECT_EQ(some.at(static_cast<size_t>(summary.number(i, "peak_frame")), "force_N"),
              summary.at(i, "largest_force_N"));
    EXPECT_FALSE(summary.at(i, "force_sd_N").empty());
  }
  EXPECT_NEAR(largest, value.at("largest_force_N").get<double>(), 0.01);
}

TEST_F(Program, FramesComeAsLinesOfJson) {
  const Ended ended = run({"process", "synthetic:fingers", "--outputs", "force,contacts", "--frames", "90",
                           "--jsonl", "--quiet", "--out", folder_ / "out"});
  ASSERT_EQ(ended.exit_code, 0) << ended.err;
  const Table table(slurp(folder_ / "out/measurements.csv"));
  const Table contacts(slurp(folder_ / "out/contacts.csv"));
  std::istringstream lines(ended.out);
  size_t frames = 0, several = 0, listed = 0;
  Json last;
  for (std::string line; std::getline(lines, line);) {
    last = parse_json(line);
    if (!last.contains("frame")) break;
    EXPECT_EQ(std::to_string(last.at("frame").get<size_t>()), table.at(frames, "frame"));
    // Each filled cell is there, and no other.
    for (const std::string& column : table.columns)
      EXPECT_EQ(last.contains(column), !table.at(frames, column).empty()) << column << " of frame " << frames;
    EXPECT_EQ(last.at("contacts").size(), static_cast<size_t>(table.number(frames, "contacts")));
    several += last.at("contacts").size() > 1;
    listed += last.at("contacts").size();
    ++frames;
  }
  EXPECT_EQ(frames, 90u);
  EXPECT_EQ(listed, contacts.rows.size());
  EXPECT_GT(several, 10u);
  EXPECT_EQ(last.at("summary").at("frames"), 90);
  EXPECT_TRUE(ended.out.ends_with("}\n"));
  const Ended both = run({"process", "synthetic:press", "--json", "--jsonl", "--out", folder_ / "o"});
  EXPECT_EQ(both.exit_code, 2);
  EXPECT_TRUE(contains(both.err, "--json and --jsonl exclude each other")) << both.err;
  const Ended refused = run({"process", folder_ / "none.avi", "--jsonl", "--out", folder_ / "o"});
  EXPECT_EQ(refused.exit_code, 3);
  EXPECT_EQ(parse_json(refused.out).at("exit_code"), 3);
}

TEST_F(Program, WithoutAScaleLengthsAreInPixelsAndOfOneContact) {
  ASSERT_EQ(run({"simulate", "fingers", "--size", "320x240", "--quiet", "--frames", "120", "--out",
                 (folder_ / "rec").string()})
                .exit_code,
            0);
  const fs::path rec = folder_ / "rec";
  Sensor sensor = load_sensor(rec / "sensor.json");
  const double pitch = sensor.pitch_mm_per_px;
  const auto measure = [&](const std::string& name) {
    const Ended ended = run({"process", (rec / "frames").string(), "--sensor", (rec / name).string(),
                             "--background", (rec / "background.png").string(), "--outputs", "force,contacts",
                             "--sequence", "--quiet", "--all-digits", "--out", (folder_ / "out").string()});
    EXPECT_EQ(ended.exit_code, 0) << ended.err;
    return std::pair(Table(slurp(folder_ / "out/measurements.csv")),
                     Table(slurp(folder_ / "out/contacts.csv")));
  };
  sensor.reading = SurfaceReading::None;
  sensor.shear.reset();
  sensor.skin.reset();
  save_sensor(sensor, rec / "scaled.json");
  const auto [in_mm, contacts_mm] = measure("scaled.json");
  sensor.pitch_mm_per_px = std::numeric_limits<double>::quiet_NaN();
  save_sensor(sensor, rec / "unscaled.json");
  EXPECT_NE(slurp(rec / "unscaled.json").find("\"pitch_mm_per_px\": null"), std::string::npos);
  const auto [in_px, contacts_px] = measure("unscaled.json");

  for (const Table* table : {&in_px, &contacts_px})
    for (const std::string& column : table->columns) {
      const bool of_shape =
          column == "area_mm2" || column.rfind("ellipse", 0) == 0 || column.rfind("shift", 0) == 0;
      EXPECT_FALSE(of_shape && column.find("_mm") != std::string::npos) << column;
    }
  size_t one = 0, several = 0;
  ASSERT_EQ(in_mm.rows.size(), in_px.rows.size());
  for (size_t i = 0; i < in_px.rows.size(); ++i) {
    const std::string count = in_px.at(i, "contacts");
    if (count == "1") {
      ++one;
      EXPECT_NEAR(in_px.number(i, "ellipse_major_px") * pitch, in_mm.number(i, "ellipse_major_mm"), 1e-6);
      EXPECT_NEAR(in_px.number(i, "shift_x_px") * pitch, in_mm.number(i, "shift_x_mm"), 1e-6);
    } else if (count != "0") {
      ++several;  // each contact has its own
      for (const char* column : {"centroid_x_px", "ellipse_major_px", "ellipse_angle_rad", "shift_x_px"})
        EXPECT_EQ(in_px.at(i, column), "") << column << " of frame " << i;
      EXPECT_GT(in_px.number(i, "area_px"), 0);
    }
  }
  EXPECT_GT(one, 5u);
  EXPECT_GT(several, 5u);
  ASSERT_EQ(contacts_px.rows.size(), contacts_mm.rows.size());
  for (size_t i = 0; i < contacts_px.rows.size(); i += 7)
    EXPECT_NEAR(contacts_px.number(i, "ellipse_minor_px") * pitch, contacts_mm.number(i, "ellipse_minor_mm"),
                1e-6);

  // A command that needs a scale says so.
  std::ofstream(rec / "shear.json") << R"({"palpate_sensor":1,"pitch_mm_per_px":null,)"
                                       R"("shear":{"kx_N_per_mm":1,"ky_N_per_mm":1,"friction":1}})";
  expect_refusal({"process", (rec / "frames").string(), "--sensor", (rec / "shear.json").string(), "--out",
                  (folder_ / "no").string()},
                 4, {"pitch_mm_per_px", "a scale"});
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
  // A later run without a film does not leave this one with its own measurements.
  ASSERT_EQ(
      run({"process", "synthetic:press?size=160x120&mode=gel", "--out", out, "--frames", "2"}).exit_code, 0);
  EXPECT_FALSE(fs::exists(out / "recording.mp4"));
}

TEST_F(Program, DemoMeasuresWhatItWasNotCalibratedOn) {
  const fs::path out = folder_ / "out";
  const Ended ended =
      run({"demo", "--headless", "--frames", "70", "--picture-every", "35", "--out", out, "--json"});
  ASSERT_EQ(ended.exit_code, 0) << ended.err;
  const Json value = parse_json(ended.out);
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

// Tuning: its limits, its file, and that exact results do not depend on it.
#include "engine/gpu/tuning.h"

#include <sys/wait.h>
#include <unistd.h>
#include <cstring>

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <random>

#include "capture/synthetic/synthetic.h"
#include "engine/gpu/commands.h"
#include "engine/pipeline/pipeline_access.h"
#include "engine/stages/frame/contact.h"
#include "palpate/error.h"
#include "palpate/pipeline.h"
#include "tests/support/gpu_fixture.h"
#include "tests/support/json.h"
#include "tests/support/pipelines.h"
#include "tests/support/test_folder.h"
#include "tests/support/text_file.h"
#include "tests/support/thorough.h"

namespace palpate {
namespace {

namespace fs = std::filesystem;

class TuningTest : public GpuTest {
 protected:
  void SetUp() override {
    GpuTest::SetUp();
    folder_ = test_folder("tuning");
  }
  void TearDown() override {
    fs::remove_all(folder_);
    GpuTest::TearDown();
  }

  fs::path file() const { return folder_ / "palpate" / "tuning.json"; }
  size_t files() const {
    size_t count = 0;
    for (const auto& entry : fs::recursive_directory_iterator(folder_)) count += entry.is_regular_file();
    return count;
  }
  /// Valid, and different from the defaults in every constant.
  static Tuning unusual() {
    const Tuning usual = default_tuning(context());
    Tuning t;
    t.contact_tiles = 1 - usual.contact_tiles;
    t.contact_rows = 6;
    t.contact_rows_keeping = 64;
    t.contact_workgroup = 256;
    t.slope_tiles = 1 - usual.slope_tiles;
    t.slope_rows = 40;
    t.slope_workgroup = 8;
    t.surface_rows_big = 36;
    t.surface_rows_small = 2;
    t.surface_big_texels = 2000;
    t.surface_workgroup = 24;
    t.surface_tiles = 1 - usual.surface_tiles;
    t.coarsest_cells = 33;
    t.rest_level_workgroup = 8;
    return t;
  }

  struct Ended {
    int exit_code;
    std::string out, err;
  };
  /// The program with this test's folder as the user's cache; the driver keeps its own.
  Ended run(const std::string& arguments) const {
    const fs::path out = folder_ / "stdout", err = folder_ / "stderr";
    const std::string line = "MESA_SHADER_CACHE_DIR='" + driver_cache() + "' XDG_CACHE_HOME='" +
                             folder_.string() + "' '" PALPATE_LAB_PROGRAM "' " + arguments + " >'" +
                             out.string() + "' 2>'" + err.string() + "'";
    const int status = std::system(line.c_str());
    Ended ended{WIFEXITED(status) ? WEXITSTATUS(status) : 1000, slurp(out), slurp(err)};
    fs::remove(out);
    fs::remove(err);
    return ended;
  }

  static std::string driver_cache() {
    if (const char* folder = std::getenv("MESA_SHADER_CACHE_DIR"); folder && *folder) return folder;
    return (gpu::cache_folder().empty() ? fs::temp_directory_path() : gpu::cache_folder().parent_path())
        .string();
  }

  fs::path folder_;
};

TEST_F(TuningTest, DefaultsAndCandidatesAreValid) {
  const Tuning usual = default_tuning(context());
  EXPECT_NO_THROW(validate(usual, context().properties().limits));
  EXPECT_NO_THROW(validate(unusual(), context().properties().limits));
  for (const TuningField& field : tuning_fields()) {
    EXPECT_GE(field.candidates.size(), field.most == 1 ? 2u : 3u) << field.name;
    EXPECT_NE(unusual().*field.value, usual.*field.value)
        << field.name << " is not told apart by these tests";
    for (const uint32_t value : field.candidates) {
      EXPECT_GE(value, field.least) << field.name;
      EXPECT_LE(value, field.most) << field.name;
      EXPECT_EQ(value % field.step, 0u) << field.name;
    }
  }
}

TEST_F(TuningTest, RefusesWhatIsOutOfRange) {
  const VkPhysicalDeviceLimits& limits = context().properties().limits;
  const auto expect_refused = [&](const Tuning& tuning, const VkPhysicalDeviceLimits& with,
                                  const std::string& name) {
    try {
      validate(tuning, with);
      ADD_FAILURE() << name << " was taken";
    } catch (const Error& error) {
      EXPECT_EQ(error.failure(), Failure::Usage);
      EXPECT_NE(std::string(error.what()).find(name), std::string::npos) << error.what();
    }
  };
  for (const TuningField& field : tuning_fields()) {
    Tuning t = default_tuning(context());
    t.*field.value = field.most + field.step;
    expect_refused(t, limits, field.name);
    if (field.least > 0) {
      t.*field.value = field.least - std::min(field.least, field.step);
      expect_refused(t, limits, field.name);
    }
    if (field.step > 1) {
      t.*field.value = field.least + field.step + 1;
      expect_refused(t, limits, field.name);
    }
  }
  Tuning wide = default_tuning(context());
  wide.surface_workgroup = 256;
  VkPhysicalDeviceLimits small = limits;
  small.maxComputeWorkGroupInvocations = 128;
  expect_refused(wide, small, "surface_workgroup");
  Tuning thin = default_tuning(context());  // 2^26 px in strips of two rows, eight invocations at a time
  thin.surface_rows_big = 2;
  thin.surface_workgroup = 8;
  small = limits;
  small.maxComputeWorkGroupCount[0] = 65535;
  expect_refused(thin, small, "surface");
  EXPECT_THROW(PipelineAccess::tuned(context(), synthetic_sensor({}), SyntheticSensor({}).format(), {}, {}),
               Error);
}

TEST_F(TuningTest, CacheComesBackAndKeepsOtherDevices) {
  const CachedTuning nothing = load_tuning(context(), file());
  EXPECT_FALSE(nothing.measured);
  EXPECT_TRUE(nothing.ignored.empty());
  EXPECT_EQ(nothing.tuning, default_tuning(context()));

  save_tuning(context(), unusual(), file());
  const CachedTuning cached = load_tuning(context(), file());
  EXPECT_TRUE(cached.measured);
  EXPECT_TRUE(cached.ignored.empty()) << cached.ignored;
  EXPECT_EQ(cached.tuning, unusual());
  EXPECT_EQ(files(), 1u);

  Json whole = parse_json(slurp(file()));
  // A file from before a key was renamed.
  std::string former = whole.dump();
  former.replace(former.find("rest_level_workgroup"), std::strlen("rest_level_workgroup"), "datum_workgroup");
  std::ofstream(file()) << former;
  EXPECT_EQ(load_tuning(context(), file()).tuning, unusual());

  Json other = whole["devices"][0];
  other["device"] = "another device";
  whole["devices"].push_back(other);
  std::ofstream(file()) << whole;
  save_tuning(context(), default_tuning(context()), file());
  whole = parse_json(slurp(file()));
  ASSERT_EQ(whole["devices"].size(), 2u);
  EXPECT_EQ(whole["devices"][0], other);
  EXPECT_EQ(load_tuning(context(), file()).tuning, default_tuning(context()));
}

TEST_F(TuningTest, MeasurementsOfOtherDevicesDriversAndKernelsAreIgnored) {
  save_tuning(context(), unusual(), file());
  const Json good = parse_json(slurp(file()));
  for (const char* key :
       {"device", "vendor_id", "device_id", "driver_version", "pipeline_cache_uuid", "kernels"}) {
    Json changed = good;
    Json& value = changed["devices"][0][key];
    value = value.is_string() ? Json("other") : Json(value.get<uint32_t>() + 1);
    std::ofstream(file()) << changed;
    const CachedTuning cached = load_tuning(context(), file());
    EXPECT_FALSE(cached.measured) << key;
    EXPECT_EQ(cached.tuning, default_tuning(context())) << key;
    const std::string name = key;
    const bool same_device = name == "driver_version" || name == "pipeline_cache_uuid" || name == "kernels";
    EXPECT_EQ(!cached.ignored.empty(), same_device) << key << ": " << cached.ignored;
  }
}

TEST_F(TuningTest, DamagedCacheIsIgnoredWithOneLineAndReplaced) {
  save_tuning(context(), unusual(), file());
  const std::string good = slurp(file());
  const auto with = [&](const char* field, const Json& value) {
    Json changed = parse_json(good);
    changed["devices"][0]["tuning"][field] = value;
    return changed.dump();
  };
  std::string newlines = good.substr(0, good.size() / 2);
  Json versioned = parse_json(good);
  versioned["palpate_tuning"] = 2;
  Json missing = parse_json(good);
  missing["devices"][0]["tuning"].erase("slope_rows");
  std::string deep = with("slope_rows", 424242);  // deeper than a stack is
  constexpr size_t kDeep = 400'000;
  deep.replace(deep.find("424242"), 6, std::string(kDeep, '[') + std::string(kDeep, ']'));
  for (const std::string& bad :
       {std::string(), std::string("\0\1\2\xff", 4), newlines, std::string("[]"),
        std::string("{\"palpate_tuning\": 1}"), versioned.dump(), missing.dump(), with("contact_rows", 65),
        with("contact_rows", -2), with("contact_workgroup", 33), with("slope_rows", "16"),
        with("slope_rows", 16.5), with("coarsest_cells", 4294967312u), with("coarsest_cells", nullptr),
        deep}) {
    std::ofstream(file(), std::ios::binary) << bad;
    const CachedTuning cached = load_tuning(context(), file());
    EXPECT_FALSE(cached.measured) << bad.substr(0, 1000);
    EXPECT_EQ(cached.tuning, default_tuning(context())) << bad.substr(0, 1000);
    EXPECT_FALSE(cached.ignored.empty()) << bad.substr(0, 1000);
    EXPECT_EQ(cached.ignored.find('\n'), std::string::npos) << cached.ignored;
    save_tuning(context(), unusual(), file());
    EXPECT_TRUE(load_tuning(context(), file()).measured) << bad.substr(0, 1000);
  }
}

TEST_F(TuningTest, UnwritableCacheIsAnOutputError) {
  std::ofstream(folder_ / "palpate") << "in the way";
  try {
    save_tuning(context(), unusual(), file());
    FAIL() << "written into a file as a folder";
  } catch (const Error& error) {
    EXPECT_EQ(error.failure(), Failure::Output) << error.what();
  }
  EXPECT_THROW(save_tuning(context(), unusual(), {}), Error);
  EXPECT_THROW(save_tuning(context(), Tuning{}, folder_ / "tuning.json"), Error);
  EXPECT_EQ(files(), 1u);
}

// Tilings of all kinds: the sums are the same to the last bit.
TEST_F(TuningTest, ExactSumsDoNotDependOnIt) {
  std::mt19937 random(7);
  for (const FrameFormat& format :
       {FrameFormat{641, 479, 1, 8}, FrameFormat{333, 130, 1, 16}, FrameFormat{200, 131, 3, 8}}) {
    Sensor sensor;
    sensor.pitch_mm_per_px = 0.1;
    sensor.channels = format.channels;
    sensor.bit_depth = format.bit_depth;
    sensor.signal = Signal::Either;
    sensor.threshold_gray = 0.25 * format.max_gray();
    sensor.saturation_gray = format.max_gray() - 3;
    Frame image, rest;
    for (Frame* frame : {&image, &rest}) {
      frame->reshape(format);
      for (uint8_t& byte : frame->bytes) byte = static_cast<uint8_t>(random());
    }
    PaddedImage padded(context(), "frame", format), background(context(), "background", format);
    padded.write(image);
    background.write(rest);
    std::optional<ContactMoments> first;
    const auto check = [&](const Tuning& tuning, bool keep) {
      const Contact contact(context(), sensor, format, keep, tuning);
      const gpu::DeviceBuffer records(context(), "records", contact.record_bytes(), gpu::Memory::Readback);
      gpu::Commands commands(context());
      commands.begin();
      padded.record(commands);
      background.record(commands);
      commands.barrier();
      contact.record(commands, padded, background, records);
      commands.host_barrier();
      commands.end();
      commands.submit();
      commands.wait();
      records.invalidate();
      const ContactMoments m = contact.sum(records.as<const shared::ContactRecord>());
      if (!first) first = m;
      EXPECT_EQ(m, *first) << format.width << " wide, rows " << tuning.contact_rows << " and "
                           << tuning.contact_rows_keeping << ", workgroup " << tuning.contact_workgroup;
    };
    check(default_tuning(context()), false);
    EXPECT_GT(first->area, 0u);
    EXPECT_GT(first->saturated, 0u);
    for (const auto& [rows, workgroup] :
         {std::pair{0u, 64u}, {2u, 64u}, {8u, 16u}, {22u, 8u}, {48u, 40u}, {64u, 256u}}) {
      Tuning tuning = default_tuning(context());
      tuning.contact_tiles = rows == 0;
      tuning.contact_rows = tuning.contact_rows_keeping = rows;
      tuning.contact_workgroup = workgroup;
      check(tuning, false);
      if (format.channels == 1) check(tuning, true);
    }
  }
}

// Whole frames: the same touch; heights within the live solver's stated error of each other.
TEST_F(TuningTest, SurfacesAgreeWithinTheStatedError) {
  for (const SyntheticMode mode : {SyntheticMode::Lambert, SyntheticMode::Gel}) {
    SyntheticOptions scene;
    scene.scene = "slide";
    scene.width = 320;
    scene.height = 243;
    scene.mode = mode;
    const SyntheticSensor source(scene);
    Frame image;
    ASSERT_TRUE(source.render(*source.frame_count() / 2, image));
    const auto measure = [&](const Tuning& tuning, Touch& touch) {
      Pipeline pipeline =
          PipelineAccess::tuned(context(), synthetic_sensor(scene), image.format, {.slots = 1}, tuning);
      pipeline.set_background(*source.own_background());
      pipeline.submit(image);
      const Result result = *pipeline.wait();
      touch = result.touch;
      std::vector<float> depth = depth_map(result);
      double mean = 0;
      for (const float d : depth) mean += double{d};
      for (float& d : depth) d -= static_cast<float>(mean / static_cast<double>(depth.size()));
      return depth;
    };
    Touch usual, other;
    const std::vector<float> a = measure(default_tuning(context()), usual);
    const std::vector<float> b = measure(unusual(), other);
    EXPECT_TRUE(usual.contact);
    EXPECT_EQ(usual.gray_sum, other.gray_sum);
    EXPECT_EQ(usual.area_px, other.area_px);
    EXPECT_EQ(usual.centroid_x_px, other.centroid_x_px);
    EXPECT_EQ(usual.centroid_y_px, other.centroid_y_px);
    EXPECT_EQ(usual.ellipse.major_mm, other.ellipse.major_mm);
    EXPECT_EQ(usual.ellipse.minor_mm, other.ellipse.minor_mm);
    EXPECT_EQ(usual.peak_gray, other.peak_gray);
    EXPECT_EQ(usual.saturated_px, other.saturated_px);
    double apart = 0, whole = 0;
    for (size_t i = 0; i < a.size(); ++i) {
      apart += std::pow(double{a[i]} - double{b[i]}, 2);
      whole += std::pow(double{a[i]}, 2);
    }
    EXPECT_GT(whole, 0);
    std::printf("heights of two tunings: %.1e apart (relative RMS)\n", std::sqrt(apart / whole));
    EXPECT_LT(std::sqrt(apart / whole), 4e-3);  // each within 2e-3 of the truth
  }
}

TEST_F(TuningTest, PipelineTakesWhatWasMeasured) {
  const char* before = std::getenv("XDG_CACHE_HOME");
  const std::string kept = before ? before : "";
  setenv("XDG_CACHE_HOME", folder_.c_str(), 1);
  SyntheticOptions scene;
  scene.mode = SyntheticMode::Lambert;
  const auto bytes = [&] {
    return Pipeline(context(), synthetic_sensor(scene), SyntheticSensor(scene).format(), {}).memory_bytes();
  };
  const uint64_t usual = bytes();
  Tuning tuning = default_tuning(context());
  tuning.coarsest_cells = 80;  // one level more, and a smaller inverse
  save_tuning(context(), tuning, tuning_file());
  const uint64_t tuned = bytes();
  before ? setenv("XDG_CACHE_HOME", kept.c_str(), 1) : unsetenv("XDG_CACHE_HOME");
  EXPECT_EQ(tuning_file() == file(), false);
  EXPECT_NE(tuned, usual);
}

TEST_F(TuningTest, ProgramMeasuresOnceAndKeepsIt) {
  const std::string quick = "tune --sizes 64x48 --repetitions 3";
  const Ended dry = run(quick + " --dry-run --json --quiet");
  ASSERT_EQ(dry.exit_code, 0) << dry.err;
  EXPECT_TRUE(dry.err.empty()) << dry.err;
  EXPECT_FALSE(fs::exists(file()));
  const Json dry_json = parse_json(dry.out);
  EXPECT_EQ(dry_json["written"], false);
  EXPECT_EQ(dry_json["parameters"].size(), tuning_fields().size());
  EXPECT_EQ(dry_json["file"], file().string());

  // Measuring takes 14 core-seconds: the file that is damaged and the first that is measured are one case,
  // and two in a thorough run.
  if (!thorough()) std::ofstream(file()) << "{";
  const Ended first = run(quick);
  ASSERT_EQ(first.exit_code, 0) << first.err;
  const auto expect_mended = [&](const Ended& ended) {
    EXPECT_EQ(ended.exit_code, 0) << ended.err;
    EXPECT_NE(ended.err.find("damaged, ignored"), std::string::npos) << ended.err;
    EXPECT_EQ(parse_json(slurp(file()))["devices"].size(), 1u);
  };
  if (!thorough()) expect_mended(first);
  ASSERT_TRUE(fs::exists(file()));
  EXPECT_NE(first.out.find("written: " + file().string()), std::string::npos) << first.out;
  for (const TuningField& field : tuning_fields())
    EXPECT_NE(first.out.find(field.name), std::string::npos) << field.name;
  const std::string written = slurp(file());

  const Ended again = run(quick + " --json");
  ASSERT_EQ(again.exit_code, 0) << again.err;
  EXPECT_EQ(parse_json(again.out)["cached"], true);
  EXPECT_EQ(slurp(file()), written);
  EXPECT_EQ(parse_json(again.out)["tuning"], parse_json(written)["devices"][0]["tuning"]);

  if (!thorough()) return;
  std::ofstream(file()) << "{";
  expect_mended(run(quick + " --force"));
}

TEST_F(TuningTest, ProgramRefusesNonsense) {
  for (const char* arguments : {"tune --sizes 640", "tune --sizes 640x", "tune --sizes 0x480",
                                "tune --sizes 15x16", "tune --sizes 640x480x3", "tune --sizes 20000x16",
                                "tune --sizes 16384x16384", "tune --sizes -640x480", "tune --repetitions 0",
                                "tune --repetitions many", "tune extra", "tune --sizes"}) {
    const Ended ended = run(arguments);
    EXPECT_EQ(ended.exit_code, 2) << arguments << ": " << ended.err;
    EXPECT_EQ(std::count(ended.err.begin(), ended.err.end(), '\n'), 1) << ended.err;
    EXPECT_TRUE(ended.out.empty());
  }
  EXPECT_EQ(run("tune --device 'no such device'").exit_code, 5);
  std::ofstream(folder_ / "palpate") << "in the way";
  const size_t before = files();
  const Ended blocked = run("tune --sizes 32x32 --repetitions 3 --quiet");
  EXPECT_EQ(blocked.exit_code, 7) << blocked.err;
  EXPECT_EQ(files(), before);
}

}  // namespace
}  // namespace palpate

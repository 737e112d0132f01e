// The Vulkan layer: devices and reasons for refusal, kernels checked against their shaders, buffers, commands
// and timers, the pipeline cache; and that synchronisation validation, on which all GPU tests rely, does see
// a missing barrier.
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <numeric>
#include <utility>

#include "engine/gpu/buffer.h"
#include "engine/gpu/commands.h"
#include "engine/gpu/context.h"
#include "engine/gpu/kernel.h"
#include "palpate/error.h"
#include "shaders/rest_level.spv.h"
#include "shaders/shared/contact.h"
#include "shaders/shared/grid.h"
#include "tests/support/gpu_fixture.h"
#include "tests/support/text_file.h"

namespace palpate::gpu {
namespace {

namespace fs = std::filesystem;

/// The rest level kernel serves as a small one: it reads float texels and whether a tile is touched, and
/// writes a record for each tile.
const Shader kShader{"rest_level", k_rest_level};
KernelInterface rest_level_interface() {
  return {
      {Binding::Texels, Binding::Storage, Binding::Storage}, sizeof(shared::RestLevelPush), {64, 1, 1}, {}};
}
constexpr uint32_t kTiles = 64;
/// 64 tiles of one texel of four pixels, in one row: record k holds the sum, lowest and highest of texel k.
const shared::RestLevelPush kPush{4 * kTiles, 1, kTiles, kTiles, 1, 1, 1};
/// Contact records of tiles that nothing touches.
DeviceBuffer no_contact(Context& context) {
  DeviceBuffer records(context, "no contact", sizeof(shared::ContactRecord) * kTiles, Memory::Upload);
  const auto bytes = records.as<uint8_t>();
  std::fill(bytes.begin(), bytes.end(), uint8_t{0});
  records.flush();
  return records;
}

ContextOptions with_validation() {
  ContextOptions options;
  options.validation = true;
  return options;
}
ContextOptions on_device(const std::string& device) {
  ContextOptions options;
  options.device = device;
  return options;
}

/// The Error that `act` must throw, as its line.
std::string refusal(const std::function<void()>& act) {
  try {
    act();
  } catch (const Error& e) {
    EXPECT_EQ(e.failure(), Failure::Device);
    return e.what();
  }
  ADD_FAILURE() << "accepted";
  return {};
}

void expect_words(const std::string& line, const std::vector<std::string>& words) {
  for (const std::string& word : words)
    EXPECT_NE(line.find(word), std::string::npos) << "no '" << word << "' in: " << line;
}

using Gpu = GpuTest;

TEST_F(Gpu, DevicesAreListedWithWhatTheyAre) {
  const std::vector<DeviceReport> devices = list_devices();
  ASSERT_FALSE(devices.empty());
  for (size_t i = 0; i < devices.size(); ++i) {
    EXPECT_EQ(devices[i].index, i);
    EXPECT_FALSE(devices[i].name.empty());
    EXPECT_FALSE(devices[i].type.empty());
    EXPECT_FALSE(devices[i].driver.empty());
    EXPECT_FALSE(devices[i].api_version.empty());
    EXPECT_GT(devices[i].memory_bytes, 0u);
  }
  // The one in use is on the list, usable, and described alike.
  const DeviceReport& used = context().report();
  ASSERT_LT(used.index, devices.size());
  EXPECT_EQ(used.name, devices[used.index].name);
  EXPECT_EQ(used.driver, devices[used.index].driver);
  EXPECT_EQ(used.memory_bytes, devices[used.index].memory_bytes);
  EXPECT_TRUE(used.refusals.empty());
  EXPECT_TRUE(devices[used.index].refusals.empty());
  EXPECT_EQ(used.name, context().properties().deviceName);
}

TEST_F(Gpu, DeviceByIndexOrPartOfItsName) {
  const DeviceReport& used = context().report();
  EXPECT_EQ(Context(on_device(std::to_string(used.index))).report().index, used.index);
  EXPECT_EQ(Context(on_device(used.name.substr(0, 6))).report().name, used.name);
}

TEST_F(Gpu, UnknownDeviceListsThoseThatExist) {
  const std::vector<DeviceReport> devices = list_devices();
  std::vector<std::string> words{"'no such device'", "not the one asked for", "palpate devices"};
  for (const DeviceReport& device : devices) words.push_back(device.name);
  expect_words(refusal([] { Context(on_device("no such device")); }), words);
  // A number is an index, not a digit of some name ("LLVM 15.0.6").
  for (uint32_t index = 0; index < 20; ++index) {
    if (index < devices.size()) continue;
    expect_words(refusal([&] { Context(on_device(std::to_string(index))); }),
                 {"'" + std::to_string(index) + "'"});
  }
}

TEST_F(Gpu, KernelsAreCheckedAgainstTheirShader) {
  const auto refused = [&](const KernelInterface& wrong) {
    return refusal([&] { Kernel(context(), kShader, wrong); });
  };
  KernelInterface wrong = rest_level_interface();
  wrong.bindings.pop_back();
  expect_words(refused(wrong), {"'rest_level'", "2 bindings", "found binding 2"});
  wrong = rest_level_interface();
  wrong.bindings.push_back(Binding::Storage);
  expect_words(refused(wrong), {"'rest_level'", "binding 3", "no such binding"});
  wrong = rest_level_interface();
  wrong.bindings[0] = Binding::Storage;
  if (!context().storage_texels())
    expect_words(refused(wrong), {"'rest_level'", "binding 0 as storage buffer", "texel buffer"});
  wrong = rest_level_interface();
  wrong.bindings[1] = Binding::Texels;
  if (!context().storage_texels())
    expect_words(refused(wrong), {"'rest_level'", "binding 1 as texel buffer", "storage buffer"});
  for (const uint32_t bytes : {0u, 24u, 40u}) {
    wrong = rest_level_interface();
    wrong.push_bytes = bytes;
    expect_words(refused(wrong),
                 {"'rest_level'", std::to_string(bytes) + " bytes of push constants", "28 bytes"});
  }
  const auto spirv = context().form(k_rest_level);
  std::vector<uint32_t> damaged(spirv.begin(), spirv.end());
  damaged[0] ^= 1;
  expect_words(refusal([&] {
                 Kernel(context(), {"damaged", {damaged, damaged}}, rest_level_interface());
               }),
               {"'damaged'"});
  expect_words(refusal([&] { Kernel(context(), {"empty", {}}, rest_level_interface()); }), {"'empty'"});
  Kernel right(context(), kShader, rest_level_interface());
  EXPECT_STREQ(right.name(), "rest_level");
  EXPECT_NE(right.pipeline(), VK_NULL_HANDLE);
  Kernel moved = std::move(right);
  EXPECT_NE(moved.pipeline(), VK_NULL_HANDLE);
  EXPECT_EQ(right.pipeline(), VK_NULL_HANDLE);  // NOLINT: what a move leaves is the point
}

// The same again is the driver's same pipeline; what differs in anything is another, and what is in use
// stays.
TEST_F(Gpu, KernelsAreCompiledOnce) {
  Context& gpu = context();
  gpu.drop_unused_kernels();
  const KernelInterface interface = rest_level_interface();
  const Kernel first(gpu, kShader, interface);
  KernelInterface wide = interface;
  wide.local_size[0] = 128;
  EXPECT_NE(Kernel(gpu, kShader, wide).pipeline(), first.pipeline());
  const auto form = gpu.form(k_rest_level);
  std::vector<uint32_t> other(form.begin(), form.end());
  ++other[2];  // the generator's version
  EXPECT_NE(Kernel(gpu, {"other", {other, other}}, interface).pipeline(), first.pipeline());
  gpu.drop_unused_kernels();
  EXPECT_EQ(Kernel(gpu, kShader, interface).pipeline(), first.pipeline());
  // Further ones, unused: those in use are none the less the same afterwards.
  for (uint32_t size = 8; size <= 128; size += 8)
    for (uint32_t version = 0; version < 17; ++version) {
      wide.local_size[0] = size;
      other[2] = version;
      const Kernel kernel(gpu, {"other", {other, other}}, wide);
      EXPECT_EQ(Kernel(gpu, {"other", {other, other}}, wide).pipeline(), kernel.pipeline());
    }
  EXPECT_EQ(Kernel(gpu, kShader, interface).pipeline(), first.pipeline());
  gpu.drop_unused_kernels();
}

TEST_F(Gpu, BuffersAreVisibleWhereTheyPromise) {
  DeviceBuffer upload(context(), "up", 1024, Memory::Upload),
      readback(context(), "down", 1024, Memory::Readback);
  const DeviceBuffer device(context(), "device", 1024, Memory::Device);
  ASSERT_TRUE(upload.mapped() && readback.mapped());
  EXPECT_TRUE(device.mapped() || !context().is_software());
  EXPECT_EQ(upload.bytes(), 1024u);
  EXPECT_EQ(upload.as<uint32_t>().size(), 256u);
  std::iota(upload.as<uint32_t>().begin(), upload.as<uint32_t>().end(), 7u);
  upload.flush();
  Commands commands(context());
  commands.begin();
  commands.copy(upload, device, 1024);
  commands.barrier();
  commands.copy(device, readback, 1024);
  commands.host_barrier();
  commands.end();
  commands.submit();
  commands.wait();
  readback.invalidate();
  for (uint32_t i = 0; i < 256; ++i) ASSERT_EQ(readback.as<uint32_t>()[i], i + 7);
  EXPECT_GE(DeviceBuffer(context(), "none", 0, Memory::Device).bytes(), 1u);

  // Moving hands the memory over and leaves an empty owner.
  const VkBuffer handle = upload.handle();
  DeviceBuffer moved = std::move(upload);
  EXPECT_EQ(moved.handle(), handle);
  EXPECT_EQ(moved.as<uint32_t>()[255], 262u);
  EXPECT_FALSE(upload);  // NOLINT: what a move leaves is the point
  EXPECT_FALSE(upload.mapped());
  moved = DeviceBuffer(context(), "other", 16, Memory::Upload);
  EXPECT_NE(moved.handle(), VK_NULL_HANDLE);
  EXPECT_EQ(moved.bytes(), 16u);
}

TEST(GpuLimits, BufferThatCannotBeHeldIsNamed) {
  Context context({});
  const std::string line =
      refusal([&] { DeviceBuffer(context, "whale", uint64_t{1} << 46, Memory::Device); });
  expect_words(line, {"whale"});
  if (context.storage_texels()) GTEST_SKIP() << "texels are read from storage buffers, of any size";
  const DeviceBuffer wide(context, "wide",
                          (uint64_t{context.properties().limits.maxTexelBufferElements} + 1) * 4,
                          Memory::Device);
  expect_words(refusal([&] { TexelView(context, wide, VK_FORMAT_R32_UINT); }),
               {std::to_string(context.properties().limits.maxTexelBufferElements)});
}

TEST_F(Gpu, CommandsRunAsOftenAsSubmittedAndTellTheirTimes) {
  const Kernel kernel(context(), kShader, rest_level_interface());
  DeviceBuffer in(context(), "in", 16 * kTiles, Memory::Upload);
  const DeviceBuffer touched = no_contact(context());
  const DeviceBuffer out(context(), "out", sizeof(shared::RestLevelRecord) * kTiles, Memory::Readback);
  const TexelView view(context(), in, VK_FORMAT_R32G32B32A32_SFLOAT);
  Commands commands(context());
  EXPECT_TRUE(commands.finished());
  commands.begin();
  {
    const auto first = commands.scope("first");
    commands.dispatch(kernel, {&view, &touched, &out}, kPush, {1, 1, 1});
    commands.barrier();
  }
  {
    const auto second = commands.scope("second");
    const auto inner = commands.scope("inner");
    commands.dispatch(kernel, {&view, &touched, &out}, kPush, {1, 1, 1});
  }
  commands.host_barrier();
  commands.end();
  for (const float offset : {0.0f, 100.0f}) {
    for (uint32_t i = 0; i < 4 * kTiles; ++i) in.as<float>()[i] = offset + static_cast<float>(i);
    in.flush();
    commands.submit();
    commands.wait();
    EXPECT_TRUE(commands.finished());
    out.invalidate();
    const auto records = out.as<const shared::RestLevelRecord>();
    for (uint32_t k = 0; k < kTiles; ++k) {
      const float first = offset + static_cast<float>(4 * k);
      ASSERT_EQ(records[k].highest, first + 3);
      ASSERT_EQ(records[k].mean, first + 1.5f);
      ASSERT_EQ(records[k].pixels, 4u);
    }
    const std::vector<ScopeTime> times = commands.times();
    ASSERT_EQ(times.size(), 3u);
    EXPECT_EQ(times[0].name, "first");
    EXPECT_EQ(times[1].name, "second");
    EXPECT_EQ(times[2].name, "inner");
    for (const ScopeTime& time : times) {
      EXPECT_GE(time.ms, 0) << time.name;
      EXPECT_LT(time.ms, 10000) << time.name;
    }
  }
  Commands moved = std::move(commands);
  moved.submit();
  moved.wait();
  EXPECT_EQ(moved.times().size(), 3u);
}

// Without an optional feature the numbers are the same, and validation reports nothing.
TEST(GpuWithout, GivesTheSameRecords) {
  const auto records = [](const ContextOptions& options) {
    Context context(options);
    EXPECT_EQ(
        context.push_descriptors() == nullptr,
        !options.push_descriptors || !has_extension(context.physical_device(), "VK_KHR_push_descriptor"));
    EXPECT_TRUE(options.texel_buffers || context.storage_texels());
    const Kernel kernel(context, kShader, rest_level_interface());
    const DeviceBuffer in(context, "in", 16 * kTiles, Memory::Upload);
    for (uint32_t i = 0; i < 4 * kTiles; ++i) in.as<float>()[i] = 0.1f * static_cast<float>(i * i);
    in.flush();
    const DeviceBuffer touched = no_contact(context);
    const DeviceBuffer out(context, "out", sizeof(shared::RestLevelRecord) * kTiles, Memory::Readback);
    const TexelView view(context, in, VK_FORMAT_R32G32B32A32_SFLOAT);
    Commands commands(context);
    commands.begin();
    {
      const auto scope = commands.scope("one");
      commands.dispatch(kernel, {&view, &touched, &out}, kPush, {1, 1, 1});
    }
    commands.host_barrier();
    commands.end();
    commands.submit();
    commands.wait();
    EXPECT_EQ(commands.times().size(), 1u);
    out.invalidate();
    for (const std::string& message : context.validation_messages()) ADD_FAILURE() << message;
    const auto bytes = out.as<const uint8_t>();
    return std::vector<uint8_t>(bytes.begin(), bytes.end());
  };
  ContextOptions options = with_validation();
  options.timers = true;
  const std::vector<uint8_t> usual = records(options);
  for (bool ContextOptions::*feature :
       {&ContextOptions::push_descriptors, &ContextOptions::texel_buffers, &ContextOptions::vulkan_1_3}) {
    ContextOptions without = options;
    without.*feature = false;
    EXPECT_EQ(records(without), usual);
  }
}

// A command buffer that is recorded each frame takes its sets from the pools that it has.
TEST(GpuWithout, PlainSetsAreUsedAgain) {
  ContextOptions options = with_validation();
  options.push_descriptors = false;
  Context context(options);
  const Kernel kernel(context, kShader, rest_level_interface());
  const DeviceBuffer in(context, "in", 16 * kTiles, Memory::Upload),
      touched = no_contact(context), out(context, "out", 16 * kTiles, Memory::Readback);
  const TexelView view(context, in, VK_FORMAT_R32G32B32A32_SFLOAT);
  Commands commands(context);
  EXPECT_EQ(commands.descriptor_pools(), 0u);
  size_t first = 0;
  for (int frame = 0; frame < 20; ++frame) {
    commands.begin();
    for (int i = 0; i < 100; ++i) {
      commands.dispatch(kernel, {&view, &touched, &out}, kPush, {1, 1, 1});
      commands.barrier();
    }
    commands.end();
    commands.submit();
    commands.wait();
    if (frame == 0) first = commands.descriptor_pools();
    EXPECT_EQ(commands.descriptor_pools(), first);
  }
  EXPECT_GT(first, 1u);
  EXPECT_LT(first, 10u);
  for (const std::string& message : context.validation_messages()) ADD_FAILURE() << message;
}

TEST(GpuWithout, EnvironmentNamesDeviceAndFeatures) {
  const auto kept = [](const char* name) {
    const char* value = std::getenv(name);
    return std::string(value ? value : "");
  };
  const std::string device = kept("PALPATE_DEVICE"), without = kept("PALPATE_WITHOUT");
  setenv("PALPATE_DEVICE", "some card", 1);
  setenv("PALPATE_WITHOUT", "texel_buffers,vulkan_1_3", 1);
  const ContextOptions found = with_environment({});
  EXPECT_EQ(found.device, "some card");
  EXPECT_TRUE(found.push_descriptors);
  EXPECT_FALSE(found.texel_buffers);
  EXPECT_FALSE(found.vulkan_1_3);
  EXPECT_EQ(with_environment(on_device("another")).device, "another");
  expect_words(refusal([] { Context({}); }), {"'some card'"});
  setenv("PALPATE_WITHOUT", "colours", 1);
  EXPECT_THROW(with_environment({}), Error);
  setenv("PALPATE_DEVICE", device.c_str(), 1);
  setenv("PALPATE_WITHOUT", without.c_str(), 1);
}

TEST(GpuTimers, AreOnlyThereWhenAskedFor) {
  Context context({});
  Commands commands(context);
  commands.begin();
  { const auto scope = commands.scope("nothing"); }
  commands.end();
  commands.submit();
  commands.wait();
  EXPECT_TRUE(commands.times().empty());
  EXPECT_TRUE(context.validation_messages().empty());
}

// Two kernels of which the second reads what the first writes. With the barrier validation is silent; without
// it must speak, or every other GPU test's silence means nothing.
TEST(GpuValidation, MissingBarrierIsReported) {
  const auto messages = [](bool with_barrier) {
    Context context(with_validation());
    const Kernel kernel(context, kShader, rest_level_interface());
    const DeviceBuffer a(context, "a", 16 * kTiles, Memory::Upload),
        b(context, "b", 16 * kTiles, Memory::Device), c(context, "c", 16 * kTiles, Memory::Readback);
    const DeviceBuffer touched = no_contact(context);
    const TexelView view_a(context, a, VK_FORMAT_R32G32B32A32_SFLOAT),
        view_b(context, b, VK_FORMAT_R32G32B32A32_SFLOAT);
    Commands commands(context);
    commands.begin();
    commands.dispatch(kernel, {&view_a, &touched, &b}, kPush, {1, 1, 1});
    if (with_barrier) commands.barrier();
    commands.dispatch(kernel, {&view_b, &touched, &c}, kPush, {1, 1, 1});
    commands.host_barrier();
    commands.end();
    commands.submit();
    commands.wait();
    return context.validation_messages();
  };
  EXPECT_TRUE(messages(true).empty());
  const std::vector<std::string> found = messages(false);
  ASSERT_FALSE(found.empty());
  EXPECT_NE(found[0].find("SYNC-HAZARD-READ-AFTER-WRITE"), std::string::npos) << found[0];
}

// GPU-assisted validation sees a kernel read beyond a buffer, where it knows the descriptors: those of plain
// sets.
TEST(GpuValidation, ReadBeyondABufferIsReported) {
  setenv("VK_LAYER_ENABLES", "VK_VALIDATION_FEATURE_ENABLE_GPU_ASSISTED_EXT", 1);
  const auto messages = [](uint32_t tiles) {
    ContextOptions options = with_validation();
    options.push_descriptors = false;
    Context context(options);
    const Kernel kernel(context, kShader, rest_level_interface());
    const DeviceBuffer in(context, "in", 16 * tiles, Memory::Upload),
        touched = no_contact(context),
        out(context, "out", sizeof(shared::RestLevelRecord) * kTiles, Memory::Readback);
    const TexelView view(context, in, VK_FORMAT_R32G32B32A32_SFLOAT);
    Commands commands(context);
    commands.begin();
    commands.dispatch(kernel, {&view, &touched, &out}, kPush, {1, 1, 1});
    commands.host_barrier();
    commands.end();
    commands.submit();
    commands.wait();
    context.wait_idle();
    std::vector<std::string> found = context.validation_messages();
    // A device without 64-bit integers has no addresses checked, which are not used.
    std::erase_if(found, [](const std::string& m) { return m.find("shaderInt64") != std::string::npos; });
    return found;
  };
  EXPECT_TRUE(messages(kTiles).empty());
  const std::vector<std::string> found = messages(kTiles / 4);
  unsetenv("VK_LAYER_ENABLES");
  ASSERT_FALSE(found.empty());
  EXPECT_NE(found[0].find("out of bounds"), std::string::npos) << found[0];
}

class PipelineCache : public testing::Test {
 protected:
  PipelineCache() {
    if (const char* before = std::getenv("XDG_CACHE_HOME")) before_ = before;
    folder_ = fs::temp_directory_path() / ("palpate-cache-" + std::to_string(getpid()));
    fs::remove_all(folder_);
    setenv("XDG_CACHE_HOME", folder_.c_str(), 1);
  }
  ~PipelineCache() override {
    if (before_.empty())
      unsetenv("XDG_CACHE_HOME");
    else
      setenv("XDG_CACHE_HOME", before_.c_str(), 1);
    fs::remove_all(folder_);
  }

  /// A program's life: open, compile a kernel, close.
  static std::vector<std::string> run_once() {
    Context context(with_validation());
    const Kernel kernel(context, kShader, rest_level_interface());
    EXPECT_NE(kernel.pipeline(), VK_NULL_HANDLE);
    return context.validation_messages();
  }
  fs::path only_file() const {
    std::vector<fs::path> found;
    for (const auto& entry : fs::directory_iterator(folder_ / "palpate")) found.push_back(entry.path());
    EXPECT_EQ(found.size(), 1u) << "one file, no temporary ones";
    return found.at(0);
  }

  std::string before_;
  fs::path folder_;
};

TEST_F(PipelineCache, IsWrittenAndSurvivesDamage) {
  EXPECT_TRUE(run_once().empty());
  const fs::path file = only_file();
  const std::string good = slurp(file);
  EXPECT_GE(good.size(), 32u);  // the header of Vulkan's format
  EXPECT_TRUE(run_once().empty());
  EXPECT_EQ(slurp(only_file()), good);
  std::string flipped = good;
  for (size_t i = 0; i < flipped.size(); i += 3) flipped[i] = static_cast<char>(flipped[i] ^ 0x5a);
  for (const std::string& damage :
       {std::string(), std::string("x"), good.substr(0, 16), good.substr(0, good.size() - 1), flipped,
        std::string(100000, '\xff'), good + std::string(1000, '\0')}) {
    std::ofstream(file, std::ios::binary | std::ios::trunc) << damage;
    for (const std::string& message : run_once()) ADD_FAILURE() << damage.size() << " bytes: " << message;
    EXPECT_EQ(slurp(only_file()), good) << "a damaged cache of " << damage.size() << " bytes is not replaced";
  }
}

TEST_F(PipelineCache, PlaceThatCannotBeWrittenCostsNothing) {
  std::ofstream(folder_) << "a file where the folder should be";
  EXPECT_TRUE(run_once().empty());
  EXPECT_TRUE(fs::is_regular_file(folder_));
}

}  // namespace
}  // namespace palpate::gpu

#include "perf/profile/model.h"

#include <algorithm>
#include <array>
#include <sstream>

#include "capture/synthetic/synthetic.h"
#include "engine/gpu/context.h"
#include "engine/gpu/kernel.h"
#include "engine/gpu/tuning.h"
#include "palpate/pipeline.h"

namespace palpate::perf {
namespace {

constexpr std::array kCards{Card{"Radeon RX 6900 XT", "navi21", 80, 2, 2.25, 512},
                            Card{"Radeon RX 7900 XTX", "gfx1100", 96, 2, 2.5, 960},
                            Card{"Radeon RX Vega 64", "vega10", 64, 4, 1.55, 484},
                            Card{"Radeon RX 480", "polaris10", 36, 4, 1.27, 256}};

// What the model assumes; perf/README.md says why.
constexpr uint32_t kWave = 64;           // invocations
constexpr double kOfBandwidth = 0.8;     // reached by kernels that stream
constexpr double kDispatch_us = 3;       // a dispatch and the barrier after it
constexpr double kSubmission_us = 20;    // of a frame: the driver, the queue and the fence
constexpr double kUpload_GB_per_s = 12;  // over PCIe
constexpr std::array kSizes{std::pair{640u, 480u}, std::pair{1392u, 1042u}};

std::string key_of(const std::string& name, const std::array<uint32_t, 3>& local_size,
                   const std::vector<uint32_t>& constants) {
  std::string key = name;
  for (const uint32_t size : local_size) key += ' ' + std::to_string(size);
  for (const uint32_t constant : constants) key += ' ' + std::to_string(constant);
  return key;
}

double value_of(const CompiledKernel& kernel, const char* statistic) {
  const auto found = kernel.values.find(statistic);
  return found == kernel.values.end() ? 0 : found->second;
}

ModelledDispatch modelled(const Card& card, const CompiledKernel& kernel, const FrameDispatch& dispatch) {
  ModelledDispatch m{.dispatch = dispatch};
  const uint64_t waves_of_group = (dispatch.workgroup + kWave - 1) / kWave;
  m.waves = dispatch.groups * waves_of_group;
  const double simds = static_cast<double>(card.units * card.simds), cycles_per_us = 1e3 * card.clock_GHz;
  const double resident = simds * std::max(value_of(kernel, "Subgroups per SIMD"), 1.0);
  const auto waves = static_cast<double>(m.waves);
  m.memory_us = static_cast<double>(dispatch.read_bytes + dispatch.written_bytes) /
                (1e3 * kOfBandwidth * card.GB_per_s);
  m.compute_us = waves / std::min(waves, simds) * value_of(kernel, "Inverse Throughput") / cycles_per_us;
  const double rounds = std::max(1.0, waves / resident);
  m.latency_us = rounds * value_of(kernel, "Latency") / cycles_per_us;
  m.total_us = kDispatch_us + std::max({m.memory_us, m.compute_us, m.latency_us});
  return m;
}

}  // namespace

const Card* card_of(const std::string& family) {
  const auto found = std::ranges::find(kCards, family, &Card::family);
  return found == kCards.end() ? nullptr : &*found;
}

std::vector<FrameWork> frames_of_work() {
  std::vector<FrameWork> frames;
  std::vector<FrameDispatch> seen;
  gpu::ContextOptions options;
  options.on_dispatch = [&](const gpu::Dispatch& d) {
    seen.push_back({d.kernel, key_of(d.kernel, d.interface.local_size, d.interface.constants), d.groups,
                    d.interface.local_size[0] * d.interface.local_size[1] * d.interface.local_size[2],
                    d.read_bytes, d.written_bytes});
  };
  gpu::Context context(options);
  PipelineOptions asked;
  asked.tuning = default_tuning(false);
  asked.slots = 1;
  for (const char* mode : {"lambert", "gel"}) {
    for (const auto& [width, height] : kSizes) {
      const SyntheticOptions scene = parse_synthetic("synthetic:press?size=" + std::to_string(width) + "x" +
                                                     std::to_string(height) + "&mode=" + mode);
      const Sensor sensor = synthetic_sensor(scene);
      seen.clear();
      const Pipeline pipeline(context, sensor, SyntheticSensor(scene).format(), asked);
      // A frame begins with its contact; a second one is the same frame with weights.
      const auto contact = [](const FrameDispatch& d) { return d.stage_kernel.starts_with("contact_tile"); };
      const auto first = std::ranges::find_if(seen, contact);
      const auto last = first == seen.end() ? first : std::find_if(first + 1, seen.end(), contact);
      frames.push_back({to_string(sensor.reconstruction), width, height, {first, last}});
    }
  }
  return frames;
}

std::vector<ModelledFrame> model(const Card& card, const std::vector<CompiledKernel>& kernels,
                                 const std::vector<FrameWork>& frames) {
  std::map<std::string, const CompiledKernel*> by_key;
  for (const CompiledKernel& kernel : kernels)
    by_key[key_of(kernel.name, kernel.local_size, kernel.constants)] = &kernel;
  static const CompiledKernel kUnknown{};
  std::vector<ModelledFrame> result;
  for (const FrameWork& work : frames) {
    ModelledFrame frame{work, {}, kSubmission_us};
    for (const FrameDispatch& dispatch : work.dispatches) {
      const auto found = by_key.find(dispatch.key);
      frame.dispatches.push_back(modelled(card, found == by_key.end() ? kUnknown : *found->second, dispatch));
      frame.total_us += frame.dispatches.back().total_us;
    }
    const double channels = work.reading == "photometric" ? 3 : 1;
    frame.total_us += channels * work.width_px * work.height_px / (1e3 * kUpload_GB_per_s);
    result.push_back(std::move(frame));
  }
  return result;
}

Profile to_profile(const Card& card, const std::vector<ModelledFrame>& frames) {
  Profile profile;
  profile.complete = true;
  profile.machine.kind = "modelled";
  profile.machine.device = std::string(card.name) + " (modelled)";
  profile.machine.device_type = "discrete GPU";
  profile.machine.driver = std::string("Mesa's Radeon compiler for ") + card.family + ", no hardware";
  profile.machine.palpate = PALPATE_VERSION;
  profile.ceiling.GB_per_s = kOfBandwidth * card.GB_per_s;
  profile.ceiling.clock = "model";
  const auto exactly = [](double ms) { return Distribution{1, ms, ms, ms, ms, ms, ms, ms}; };
  for (const ModelledFrame& frame : frames) {
    SizeFigure size;
    size.reading = frame.work.reading;
    size.width_px = frame.work.width_px;
    size.height_px = frame.work.height_px;
    size.latency = exactly(1e-3 * frame.total_us);
    profile.sizes.push_back(size);
  }
  return profile;
}

Table table_of(const Card& card, const std::vector<ModelledFrame>& frames) {
  Table table{std::string("Modelled: ") + card.name,
              "No measurement: the compiler's figures and the card's published ones; microseconds",
              {"reading", "size", "kernel", "waves", "memory_us", "compute_us", "latency_us", "total_us"},
              {}};
  for (const ModelledFrame& frame : frames) {
    const std::string size = size_text(frame.work.width_px, frame.work.height_px);
    for (const ModelledDispatch& d : frame.dispatches)
      table.rows.push_back({frame.work.reading, size, d.dispatch.stage_kernel, std::to_string(d.waves),
                            figure(d.memory_us), figure(d.compute_us), figure(d.latency_us),
                            figure(d.total_us)});
    table.rows.push_back({frame.work.reading, size, "whole frame", std::to_string(frame.dispatches.size()),
                          "", "", "", figure(frame.total_us)});
  }
  return table;
}

std::string to_csv(const std::map<std::string, std::vector<ModelledFrame>>& cards) {
  std::ostringstream csv;
  csv << "family,reading,width_px,height_px,kernel,groups,workgroup,waves,read_bytes,written_bytes,memory_us,"
         "compute_us,latency_us,total_us\n";
  csv.precision(4);
  for (const auto& [family, frames] : cards)
    for (const ModelledFrame& frame : frames) {
      const std::string place = family + ',' + frame.work.reading + ',' +
                                std::to_string(frame.work.width_px) + ',' +
                                std::to_string(frame.work.height_px) + ',';
      for (const ModelledDispatch& d : frame.dispatches)
        csv << place << d.dispatch.stage_kernel << ',' << d.dispatch.groups << ',' << d.dispatch.workgroup
            << ',' << d.waves << ',' << d.dispatch.read_bytes << ',' << d.dispatch.written_bytes << ','
            << d.memory_us << ',' << d.compute_us << ',' << d.latency_us << ',' << d.total_us << '\n';
      csv << place << "whole frame,,,,,,,,," << frame.total_us << '\n';
    }
  return csv.str();
}

}  // namespace palpate::perf

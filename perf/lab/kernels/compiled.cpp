#include "perf/lab/kernels/compiled.h"

#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <set>
#include <sstream>
#include <tuple>

#include "capture/synthetic/synthetic.h"
#include "engine/base/json.h"
#include "engine/fem/device/kernels.h"
#include "engine/gpu/context.h"
#include "engine/gpu/kernel.h"
#include "engine/gpu/tuning.h"
#include "engine/pipeline/pipeline_access.h"
#include "palpate/error.h"
#include "palpate/pipeline.h"

namespace palpate::perf {
namespace {

constexpr const char* kDriver = "/usr/share/vulkan/icd.d/radeon_icd.x86_64.json";

struct Column {
  const char* name;
  const char* statistic;  ///< the driver's
};
constexpr std::array kColumns{Column{"VGPRs", "VGPRs"},
                              Column{"SGPRs", "SGPRs"},
                              Column{"spilled_VGPRs", "Spilled VGPRs"},
                              Column{"spilled_SGPRs", "Spilled SGPRs"},
                              Column{"scratch_bytes", "Scratch size"},
                              Column{"LDS_bytes", "LDS size"},
                              Column{"waves_per_SIMD", "Subgroups per SIMD"},
                              Column{"instructions", "Instructions"},
                              Column{"code_bytes", "Code size"},
                              Column{"latency_cycles", "Latency"},
                              Column{"inverse_throughput_cycles", "Inverse Throughput"}};

double value_of(const CompiledKernel& kernel, const char* statistic) {
  const auto found = kernel.values.find(statistic);
  return found == kernel.values.end() ? 0 : found->second;
}

struct Recipe {
  gpu::Shader shader;
  gpu::KernelInterface interface;
};

/// Outputs that pipelines of this kind of sensor can be asked for.
struct Kind {
  const char* scene;
  std::vector<Outputs> outputs;
};

std::vector<Kind> kinds() {
  const Outputs force = Output::Force, surface = force | Output::Surface;
  const Outputs known = surface | Output::Confidence, contacts = surface | Output::Contacts;
  const Outputs sums = force | Output::Contacts, gradient = force | Output::Gradient,
                skin = force | Output::Skin;
  return {
      {"press?size=640x480", {force, sums, contacts, gradient, known | Output::Contacts}},
      {"press?size=640x480&bits=12", {surface, sums, contacts, known}},
      {"press?size=640x480&skin=texture", {skin}},
      {"press?size=640x480&bits=12&skin=texture", {skin}},
      {"press?size=640x480&mode=lambert", {surface, contacts, known}},
      {"press?size=640x480&mode=gel",
       {surface, sums, contacts, gradient, known, contacts | Output::Traction, contacts | Output::Motion}},
      {"press?size=640x480&mode=gel&skin=markers", {surface, known, skin}}};
}

/// The sensor of a scene, then with what calibrations can add to it.
std::vector<Sensor> sensors_of(const Sensor& plain) {
  std::vector<Sensor> sensors{plain};
  if (plain.reading == SurfaceReading::Photometric) {
    Sensor placed = plain;  // of a good calibration: products of colours, degree 2 in place
    placed.photometric.wx.assign(9, std::vector<double>(6, 0.01));
    placed.photometric.wy = placed.photometric.wx;
    sensors.push_back(placed);
  } else if (plain.channels == 1) {
    Sensor lookup = plain;
    lookup.reading = SurfaceReading::Lookup;
    lookup.lookup.points = {{0, 0}, {200, 1}};
    sensors.push_back(lookup);
  }
  Sensor unfiltered = plain;
  unfiltered.reading = SurfaceReading::None;
  unfiltered.filter = Filter::None;
  sensors.push_back(unfiltered);
  return sensors;
}

/// Makes pipelines of all kinds on the machine's own device and notes their kernels.
std::vector<Recipe> recipes() {
  std::vector<Recipe> found;
  std::set<std::tuple<std::string, std::array<uint32_t, 3>, std::vector<uint32_t>>> seen;
  gpu::ContextOptions options;
  options.on_kernel = [&](const gpu::Shader& shader, const gpu::KernelInterface& interface) {
    if (seen.emplace(shader.name, interface.local_size, interface.constants).second)
      found.push_back({shader, interface});
  };
  gpu::Context context(options);
  PipelineOptions asked;
  asked.slots = 1;
  asked.solve_by = SolveBy::Device;
  asked.upload = Upload::Import;
  for (const Kind& kind : kinds()) {
    const SyntheticOptions scene = parse_synthetic(std::string("synthetic:") + kind.scene);
    const FrameFormat format = SyntheticSensor(scene).format();
    for (const Sensor& sensor : sensors_of(synthetic_sensor(scene))) {
      for (const Outputs outputs : kind.outputs) {
        for (const SurfaceSolver solver : {SurfaceSolver::Live, SurfaceSolver::Best}) {
          asked.outputs = outputs;
          asked.solver = solver;
          try {
            PipelineAccess::tuned(context, sensor, format, asked, default_tuning(false));
          } catch (const Error& error) {
            if (error.failure() == Failure::Device) throw;  // else: no such sensor, or not this output of it
          }
        }
      }
    }
  }
  if (context.has_double())
    for (const bool layered : {false, true}) fem::Kernels(context, layered);
  return found;
}

/// In the child: one line for each number, "kernel 64,1,1 16,2, VGPRs<TAB>value".
void compile_all(const std::string& family, std::ostream& out) {
  setenv("RADV_FORCE_FAMILY", family.c_str(), 1);
  setenv("VK_ADD_DRIVER_FILES", kDriver, 1);
  setenv("MESA_SHADER_CACHE_DISABLE", "true", 1);
  gpu::ContextOptions options;
  options.device = "Null hardware";
  options.statistics = true;
  gpu::Context& context = *new gpu::Context(options);  // never destroyed: the driver would crash
  unsetenv("RADV_FORCE_FAMILY");
  for (const auto& [shader, interface] : recipes()) {
    const gpu::Kernel kernel(context, shader, interface);
    for (const auto& [name, value] : kernel.statistics()) {
      out << shader.name << ' ';
      for (const uint32_t size : interface.local_size) out << size << ',';
      out << ' ';
      for (const uint32_t constant : interface.constants) out << constant << ',';
      out << '\t' << name << '\t' << value << '\n';
    }
  }
}

std::vector<uint32_t> numbers(const std::string& list) {
  std::vector<uint32_t> found;
  std::istringstream in(list);
  for (std::string one; std::getline(in, one, ',');)
    found.push_back(static_cast<uint32_t>(std::strtoul(one.c_str(), nullptr, 10)));
  return found;
}

std::vector<CompiledKernel> parse(const std::string& text) {
  std::vector<CompiledKernel> kernels;
  std::string last;
  std::istringstream in(text);
  for (std::string line; std::getline(in, line);) {
    const size_t tab = line.find('\t'), second = line.find('\t', tab + 1);
    if (second == std::string::npos) continue;
    const std::string key = line.substr(0, tab);
    if (key != last) {
      std::istringstream parts(key);
      CompiledKernel kernel;
      std::string size, constants;
      std::getline(parts, kernel.name, ' ');
      std::getline(parts, size, ' ');
      std::getline(parts, constants, ' ');
      const std::vector<uint32_t> sizes = numbers(size);
      std::copy_n(sizes.begin(), std::min<size_t>(sizes.size(), 3), kernel.local_size.begin());
      kernel.constants = numbers(constants);
      kernels.push_back(kernel);
      last = key;
    }
    kernels.back().values[line.substr(tab + 1, second - tab - 1)] =
        std::strtod(line.c_str() + second + 1, nullptr);
  }
  return kernels;
}

/// Output of the child; empty `error`: it ended well.
std::string in_a_child(const std::function<void(std::ostream&)>& work, std::string& error) {
  int ends[2];
  if (pipe(ends) != 0) throw Error(Failure::Output, "a pipe", "none", "fewer open files");
  const pid_t child = fork();
  if (child < 0) throw Error(Failure::Output, "another process", "none", "fewer processes");
  if (child == 0) {
    // The driver's own words, "Unknown family", are not ours.
    if (const int nowhere = open("/dev/null", O_WRONLY); nowhere >= 0) dup2(nowhere, STDERR_FILENO);
    std::ostringstream out;
    try {
      work(out);
    } catch (const std::exception& failure) {
      out.str(std::string("error ") + failure.what() + "\n");
    }
    const std::string text = out.str();
    for (size_t at = 0; at < text.size();) {
      const ssize_t written = write(ends[1], text.data() + at, text.size() - at);
      if (written <= 0) _exit(1);
      at += static_cast<size_t>(written);
    }
    _exit(0);  // no destructors: see above
  }
  close(ends[1]);
  std::string text;
  std::array<char, 65536> part;
  for (ssize_t got; (got = read(ends[0], part.data(), part.size())) > 0;)
    text.append(part.data(), static_cast<size_t>(got));
  close(ends[0]);
  int status = 0;
  waitpid(child, &status, 0);
  if (!WIFEXITED(status) || WEXITSTATUS(status) != 0) error = "the driver gave up";
  if (text.starts_with("error ")) error = text.substr(6, text.find('\n') - 6);
  return text;
}

}  // namespace

std::vector<CompiledKernel> compile_for(const std::string& family) {
  if (!std::filesystem::exists(kDriver))
    throw Error(Failure::Device, "Mesa's Radeon driver", std::string("no ") + kDriver,
                "installing mesa-vulkan-drivers");
  std::string error;
  const std::string text = in_a_child([&](std::ostream& out) { compile_all(family, out); }, error);
  if (!error.empty())
    throw Error(Failure::Device, "kernels compiled for " + family, error,
                "a family that Mesa's Radeon driver knows: navi21, gfx1100, vega10, polaris10");
  return parse(text);
}

Table table_of(const std::string& family, const std::vector<CompiledKernel>& kernels) {
  Table table;
  table.title = "Kernels compiled for " + family;
  table.note =
      "registers, spills and waves a SIMD as the driver counts them; latency in cycles is its estimate";
  table.columns = {"kernel", "workgroup"};
  for (const Column& column : kColumns) table.columns.emplace_back(column.name);
  std::vector<CompiledKernel> sorted = kernels;
  std::ranges::stable_sort(sorted, std::greater(), [](const CompiledKernel& k) {
    return std::pair(value_of(k, "Spilled VGPRs") + value_of(k, "Spilled SGPRs"), value_of(k, "Latency"));
  });
  for (const CompiledKernel& kernel : sorted) {
    std::vector<std::string> row{kernel.name, std::to_string(kernel.local_size[0])};
    for (const Column& column : kColumns) row.push_back(figure(value_of(kernel, column.statistic)));
    table.rows.push_back(row);
  }
  return table;
}

std::string to_csv(const std::map<std::string, std::vector<CompiledKernel>>& families) {
  std::ostringstream csv;
  csv << "family,kernel,workgroup,constants";
  for (const Column& column : kColumns) csv << ',' << column.name;
  csv << '\n';
  for (const auto& [family, kernels] : families) {
    for (const CompiledKernel& kernel : kernels) {
      csv << family << ',' << kernel.name << ',' << kernel.local_size[0] << ',';
      for (size_t i = 0; i < kernel.constants.size(); ++i) csv << (i ? " " : "") << kernel.constants[i];
      for (const Column& column : kColumns)
        csv << ',' << static_cast<int64_t>(value_of(kernel, column.statistic));
      csv << '\n';
    }
  }
  return csv.str();
}

json::Value to_json(const std::map<std::string, std::vector<CompiledKernel>>& families) {
  json::Value all = json::Value::array();
  for (const auto& [family, kernels] : families) {
    for (const CompiledKernel& kernel : kernels) {
      json::Value one = {{"family", family}, {"kernel", kernel.name}, {"workgroup", kernel.local_size[0]}};
      for (const Column& column : kColumns) one[column.name] = value_of(kernel, column.statistic);
      all.push_back(one);
    }
  }
  return all;
}

}  // namespace palpate::perf

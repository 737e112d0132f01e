// palpate-lab goals: speed goals of the frame pipeline: each goal against its rival, paired in one run. A row
// that is short does not change the exit code.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <memory>
#include <sstream>

#include "capture/files/output_file.h"
#include "engine/base/json.h"
#include "engine/base/text.h"
#include "engine/gpu/commands.h"
#include "engine/gpu/context.h"
#include "engine/sensor/outline.h"
#include "engine/stages/frame/contact.h"
#include "engine/stages/frame/upload.h"
#include "palpate/pipeline.h"
#include "perf/lab/commands/commands.h"
#include "perf/lab/rivals/skin_run.h"
#include "perf/lab/say.h"
#include "perf/measure.h"
#include "perf/profile/frames.h"
#include "perf/profile/gpu_solvers.h"
#include "perf/profile/scene.h"
#include "perf/rivals/rivals.h"
#include "viz/commands/support/options.h"

namespace palpate::perf {
namespace {

constexpr Size kSmall{640, 480, 640, 480};
constexpr Size kLarge{1392, 1042, 1400, 1050};
constexpr double kPoissonError = 1e-3;

struct Row {
  std::string name;
  std::string goal;
  double figure = 0;
  double low = 0;  ///< half of all paired repetitions lie between low and high
  double high = 0;
  bool met = false;
  std::string note = {};
};

/// The same work, or there is nothing to compare.
struct Check {
  std::string what;
  double apart = 0;  ///< relative
  double allowed = 0;
  bool holds() const { return apart <= allowed; }  // false for NaN too
};

double apart(double a, double b) {
  return std::abs(a - b) / std::max(std::abs(b), 1e-300);
}

/// RMS difference of two height maps about their means, relative to the second.
double apart(const std::vector<float>& a, const std::vector<float>& b) {
  double mean_a = 0, mean_b = 0, wrong = 0, whole = 0;
  for (size_t i = 0; i < a.size(); ++i) {
    mean_a += double{a[i]};
    mean_b += double{b[i]};
  }
  mean_a /= static_cast<double>(a.size());
  mean_b /= static_cast<double>(b.size());
  for (size_t i = 0; i < a.size(); ++i) {
    const double x = double{a[i]} - mean_a, y = double{b[i]} - mean_b;
    wrong += (x - y) * (x - y);
    whole += y * y;
  }
  return std::sqrt(wrong / whole);
}

class Goals {
 public:
  Goals(gpu::Context& context, int repetitions) : context_(context), repetitions_(repetitions) {}

  void run() {
    contact();
    for (const Size& size : {kSmall, kLarge}) surface(size, size.width == kSmall.width ? 0.6 : 0.33);
    for (const Size& size : {kSmall, kLarge}) {
      frame(size, SyntheticMode::Lambert);
      frame(size, SyntheticMode::Gel);
      throughput(size, size.width == kSmall.width ? 200 : 35);
    }
    for (const bool live : {true, false}) outline(kSmall, live);
    force_only(kLarge);
    for (const Size& size : {kSmall, kLarge})
      for (const char* pattern : {"markers", "texture"}) skin(size, pattern);
  }

  const std::vector<Row>& rows() const { return rows_; }
  const std::vector<Check>& checks() const { return checks_; }

 private:
  Pipeline pipeline_for(const Sensor& sensor, const Frame& background, PipelineOptions options) {
    options.slots = std::max(options.slots, 1u);
    Pipeline pipeline(context_, sensor, background.format, options);
    pipeline.set_background(background);
    return pipeline;
  }
  static std::vector<float> heights(Pipeline& pipeline, const Frame& image) {
    pipeline.submit(image);
    const Result result = *pipeline.wait();
    const std::span<const float> depth = result.depth_mm();
    return {depth.begin(), depth.end()};
  }

  /// Runs in one sample: enough for warm caches, few enough for the minute.
  static int inner(const Size& size) { return size.width > kSmall.width ? 2 : 5; }

  void at_most(const std::string& name, double limit, const Pair& pair, bool also = true,
               const std::string& note = "") {
    const Quartiles& q = pair.cpu_ratios;
    rows_.push_back({name, text("<= %.2f x ", limit) + pair.rival.name, q.median, q.low, q.high,
                     q.median <= limit && also,
                     text("CPU %.2f and %.2f ms", pair.ours.cpu_ms.median, pair.rival.cpu_ms.median) +
                         (note.empty() ? "" : "; " + note)});
  }

  void contact() {
    const Size size = kLarge;
    Scene scene = scene_for(size, SyntheticMode::Lambert);
    PipelineOptions force;
    force.outputs = Output::Force;
    Pipeline pipeline = pipeline_for(scene.sensor, scene.background, force);
    OpenCvContact rival(scene.background, scene.sensor);
    const Touch touch = pipeline.process(scene.frames[0]).touch;
    // In 8 bits the filter rounds; in floats a pixel darker than the background counts against its
    // neighbours.
    check("gray sum, OpenCV 8 bit", apart(rival.run_8bit(scene.frames[0]), touch.gray_sum), 5e-3);
    check("gray sum, OpenCV float", apart(rival.run_float(scene.frames[0]), touch.gray_sum), 1e-3);
    check("area, OpenCV float", apart(rival.area_px(), static_cast<double>(touch.area_px)), 1e-3);

    const Work ours{"palpate", [&] { pipeline.process(scene.next()); }};
    at_most("contact " + size.text(), 0.95,
            compare("", "", ours, {"OpenCV 8 bit", [&] { sink_ += rival.run_8bit(scene.next()); }},
                    repetitions_, 4));
    const Pair wide = compare("", "", ours, {"OpenCV float", [&] { sink_ += rival.run_float(scene.next()); }},
                              repetitions_, 2);
    const Quartiles& q = wide.cpu_ratios;
    rows_.push_back({"contact " + size.text(), ">= 8 x faster than OpenCV float", 1 / q.median, 1 / q.high,
                     1 / q.low, 1 / q.median >= 8,
                     text("CPU %.2f and %.2f ms", wide.ours.cpu_ms.median, wide.rival.cpu_ms.median)});
    moments(scene, rival);
  }

  // Met also needs an error of at most the rival's and a tenth.
  void skin(const Size& size, const std::string& pattern) {
    SkinRun run(context_, size.text(), pattern);
    const Pair pair =
        compare("", "", {"palpate", [&] { run.follow(); }},
                {"calcOpticalFlowPyrLK", [&] { run.rival_follow(); }}, repetitions_, inner(size));
    const auto [ours_px, theirs_px] = run.errors_px();
    const bool small = size.width == kSmall.width;
    const double limit = pattern == "texture" ? (small ? 0.93 : 0.97) : (small ? 0.96 : 0.65);
    at_most("skin of " + pattern + " " + size.text(), limit, pair, ours_px <= 1.1 * theirs_px,
            text("%zu points, RMS error %.3f and %.3f px", run.points(), ours_px, theirs_px));
  }

  // The rival's own image, filtered and 0 without contact, summed by a sensor without background and filter.
  // Ours gives the area's moments, the peak and the saturated pixels too.
  void moments(const Scene& scene, OpenCvContact& rival) {
    rival.run_8bit(scene.frames[0]);
    const Frame image = rival.contact_8bit();
    Sensor sensor = scene.sensor;
    sensor.reading = SurfaceReading::None;
    sensor.filter = Filter::None;
    sensor.background = {BackgroundKind::None, "", 1};
    const Contact contact(context_, sensor, image.format, false, load_tuning(context_).tuning);
    PaddedImage frame(context_, "frame", image.format);
    frame.write(image);
    const gpu::DeviceBuffer records(context_, "records", contact.record_bytes(), gpu::Memory::Readback);
    gpu::Commands load(context_), commands(context_);
    load.begin();
    frame.record(load);
    load.end();
    load.submit();
    load.wait();
    commands.begin();
    contact.record(commands, frame, frame, records);
    commands.host_barrier();
    commands.end();
    ContactMoments m;
    const Work ours{"palpate", [&] {
                      commands.submit();
                      commands.wait();
                      records.invalidate();
                      m = contact.sum(records.as<const shared::ContactRecord>());
                    }};
    at_most(
        "moments alone " + kLarge.text(), 0.5,
        compare("", "", ours, {"cv::moments 8 bit", [&] { sink_ += rival.moments_8bit(); }}, repetitions_, 4),
        true, "ours also area, peak, saturated");
    check("gray sum of moments alone", apart(rival.moments_8bit(), static_cast<double>(m.gray) / 256), 1e-12);
  }

  void surface(const Size& size, double limit) {
    const FrameSize frame{size.width, size.height};
    const std::vector<Truth> truths = make_truths(frame);
    const Truth& smooth = truths.front();
    GpuSlopes slopes(context_, frame);
    MultigridSolver live(context_, slopes, Solve::Live), pixels(context_, slopes, Solve::Converged);
    slopes.load(smooth);
    live.prepare();
    pixels.prepare();
    const std::vector<float> right = pixels.right_side();
    std::vector<float> z(right.size());
    FftwPoisson rival(size.width, size.height, size.padded_width, size.padded_height);
    const Pair pair =
        compare("", "", {"palpate", [&] { live.solve(); }},
                {"FFTW " + std::to_string(size.padded_width) + "x" + std::to_string(size.padded_height),
                 [&] { rival.solve(right.data(), z.data()); }},
                repetitions_, inner(size));
    const double ours_error = live.errors(smooth).relative_rms;
    const double rival_error = errors_of(smooth, frame, [&](uint32_t x, uint32_t y) {
                                 return double{z[size_t{y} * size.width + x]};
                               }).relative_rms;
    at_most("Poisson " + size.text(), limit, pair, ours_error <= kPoissonError,
            text("relative RMS error %.1e and %.1e", ours_error, rival_error));
    check("heights, FFTW " + size.text(), rival_error, kPoissonError);
  }

  void frame(const Size& size, SyntheticMode mode) {
    Scene scene = scene_for(size, mode);
    const std::string reading = to_string(scene.sensor.reading);
    Pipeline pipeline = pipeline_for(scene.sensor, scene.background, {});
    OpenCvFftwFrame rival(scene.background, scene.sensor, size.padded_width, size.padded_height);
    const Pair pair =
        compare("", "", {"palpate", [&] { pipeline.process(scene.next()); }},
                {"OpenCV + FFTW", [&] { sink_ += rival.run(scene.next()); }}, repetitions_, inner(size));
    rival.run(scene.frames[0]);
    const double difference = apart(heights(pipeline, scene.frames[0]), rival.heights_mm());
    const bool small = size.width == kSmall.width, shading = mode == SyntheticMode::Lambert;
    const double limit = shading ? (small ? 0.42 : 0.36) : (small ? 0.45 : 0.42);
    at_most("frame to height " + size.text() + ", " + reading, limit, pair, true,
            text("heights %.1e apart", difference));
    // Shading: the rival takes the direction of a slope from a pixel's neighbours, noise and all; the same
    // amount of work, not the same heights.
    if (scene.sensor.reading == SurfaceReading::Photometric)
      check("heights of a frame " + size.text() + ", " + reading, difference, 0.02);
  }

  /// Wall time with three frames in flight, as `palpate process` runs; the spread is that of tenths of the
  /// run.
  void throughput(const Size& size, double wanted) {
    Scene scene = scene_for(size, SyntheticMode::Lambert);
    Pipeline pipeline = pipeline_for(scene.sensor, scene.background, {});
    const int frames = repetitions_ == 1 ? 3 : size.width > kSmall.width ? 10 : 30;
    std::vector<double> rates;
    for (int part = 0; part < std::min(repetitions_, 10); ++part) {
      const Sample s = time_runs(
          [&] {
            while (!pipeline.submit(scene.next())) pipeline.wait();
          },
          frames);
      rates.push_back(1e3 / s.wall_ms);
    }
    while (pipeline.wait()) {
    }
    const Quartiles q = quartiles(rates);
    rows_.push_back({"throughput " + size.text(), text(">= %.0f frames/s", wanted), q.median, q.low, q.high,
                     q.median >= wanted, "wall time, three in flight"});
  }

  /// A round pad's outline, and a highlight within it that only the frame has, against the plain solve.
  /// Errors are against the exact solve of the same frame, where the pad is.
  void outline(const Size& size, bool live) {
    Scene scene = scene_for(size, SyntheticMode::Gel);
    Sensor round = scene.sensor;
    const double x0 = size.width / 2.0, y0 = size.height / 2.0, radius = 0.47 * size.height;
    round.pad = PadEllipse{x0, y0, radius, radius, 0};
    Scene spoiled = scene;
    for (Frame& frame : spoiled.frames)
      for (uint32_t y = 0; y < 9; ++y)
        for (uint32_t x = 0; x < 9; ++x)
          for (uint32_t c = 0; c < 3; ++c)
            frame.set(c, static_cast<uint32_t>(x0) + x, static_cast<uint32_t>(y0) + y, 255);
    const auto inside = [&](const std::vector<float>& all) {
      std::vector<float> part;
      for (size_t i = 0; i < all.size(); ++i)
        if (contains(*round.pad, static_cast<double>(i % size.width), static_cast<double>(i / size.width)))
          part.push_back(all[i]);
      return part;
    };
    PipelineOptions options, exact;
    options.solver = live ? SurfaceSolver::Live : SurfaceSolver::Best;
    options.solve_by = SolveBy::Device;
    exact.solver = SurfaceSolver::Best;
    exact.solve_by = SolveBy::Host;
    Pipeline plain = pipeline_for(scene.sensor, scene.background, options);
    Pipeline plain_reference = pipeline_for(scene.sensor, scene.background, exact);
    Pipeline ours = pipeline_for(round, scene.background, options);
    Pipeline reference = pipeline_for(round, scene.background, exact);
    const double plain_error =
        apart(inside(heights(plain, scene.frames[0])), inside(heights(plain_reference, scene.frames[0])));
    const auto row = [&](const std::string& name, Scene& frames, double limit) {
      Scene again = scene;
      const double error =
          apart(inside(heights(ours, frames.frames[0])), inside(heights(reference, frames.frames[0])));
      const Pair pair = compare("", "", {"palpate", [&] { ours.process(frames.next()); }},
                                {"plain solve", [&] { plain.process(again.next()); }}, repetitions_,
                                live ? inner(size) : 1);
      at_most(name + (live ? ", live " : ", converged ") + size.text(), limit, pair,
              error <= std::max(2 * plain_error, kPoissonError),
              text("%.1e of the exact solve, plain %.1e", error, plain_error));
    };
    row("round pad", scene, 1.6);
    row("round pad and a highlight", spoiled, 3);
  }

  void force_only(const Size& size) {
    Scene scene = scene_for(size, SyntheticMode::Lambert);
    PipelineOptions force;
    force.outputs = Output::Force;
    Pipeline few = pipeline_for(scene.sensor, scene.background, force);
    Pipeline full = pipeline_for(scene.sensor, scene.background, {});
    const double few_MB = static_cast<double>(few.memory_bytes()) / 1e6,
                 full_MB = static_cast<double>(full.memory_bytes()) / 1e6;
    // Frames in flight and background are what is left; not one float a pixel of height or slope.
    const bool lean = few.memory_bytes() < uint64_t{4} * size.width * size.height * 2;
    at_most("force only " + size.text(), 0.11,
            compare("", "", {"palpate", [&] { few.process(scene.next()); }},
                    {"full frame", [&] { full.process(scene.next()); }}, repetitions_, 3),
            lean, text("%.1f of %.1f MB on the device", few_MB, full_MB));
  }

  void check(const std::string& what, double by, double allowed) { checks_.push_back({what, by, allowed}); }

  gpu::Context& context_;
  int repetitions_;
  double sink_ = 0;
  std::vector<Row> rows_;
  std::vector<Check> checks_;
};

std::string csv(const std::vector<Row>& rows) {
  std::ostringstream out;
  out.precision(4);
  out << "row,goal,figure,lower_quartile,upper_quartile,verdict,note\n";
  for (const Row& row : rows)
    out << '"' << row.name << "\",\"" << row.goal << "\"," << row.figure << ',' << row.low << ',' << row.high
        << ',' << (row.met ? "met" : "short") << ",\"" << row.note << "\"\n";
  return out.str();
}

Report run(const Common& common, int repetitions) {
  if (common.json) say_nothing();
  const auto start = std::chrono::steady_clock::now();
  gpu::ContextOptions device;
  device.device = common.device;
  device.validation = common.validation;
  gpu::Context context(device);
  if (!common.out.empty()) make_output_folder(common.out);
  say(text("%s, %s\n", context.report().name.c_str(), context.report().driver.c_str()));
  Goals goals(context, repetitions);
  goals.run();
  json::Value rows = json::Value::array(), checks = json::Value::array();
  for (const Check& c : goals.checks()) {
    say(text("same work: %-44s %.1e apart, %.0e allowed%s\n", c.what.c_str(), c.apart, c.allowed,
             c.holds() ? "" : "  DIFFERENT WORK"));
    checks.push_back({{"what", c.what}, {"apart", c.apart}, {"allowed", c.allowed}, {"holds", c.holds()}});
  }
  say(text("\n%-44s| %-32s| %8s | %-15s | %-5s | %s\n", "row", "goal", "figure", "spread", "", ""));
  for (const Row& row : goals.rows()) {
    say(text("%-44s| %-32s| %8.3g | %6.3g to %-6.3g| %-5s | %s\n", row.name.c_str(), row.goal.c_str(),
             row.figure, row.low, row.high, row.met ? "met" : "short", row.note.c_str()));
    rows.push_back({{"row", row.name},
                    {"goal", row.goal},
                    {"figure", row.figure},
                    {"lower_quartile", row.low},
                    {"upper_quartile", row.high},
                    {"met", row.met},
                    {"note", row.note}});
  }
  say(text("%.0f s\n", std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count()));
  if (!common.out.empty()) write_whole(common.out / "goals.csv", std::string_view(csv(goals.rows())));
  const bool same =
      std::all_of(goals.checks().begin(), goals.checks().end(), [](const Check& c) { return c.holds(); });
  const bool clean = validation_clean(context);
  return {"", json::Value({{"rows", rows}, {"same_work", checks}}), same && clean ? 0 : kInternalError};
}

}  // namespace
}  // namespace palpate::perf

namespace palpate {

void add_goals(CommandLine& program, Common& common, Command& chosen) {
  CommandLine* command = program.add_subcommand(
      "goals",
      "The frame pipeline's goals against their rivals, paired in one run, by CPU time of the process");
  auto repetitions = std::make_shared<int>(15);
  command->add_setting("--repetitions", *repetitions, Check::range(1, 1000),
                       "Paired repetitions of each row");
  command->add_option("--out", common.out, "Folder for goals.csv");
  add_common(
      *command, common,
      "  palpate-lab goals                              a minute or two\n"
      "  palpate-lab goals --repetitions 9 --out out/goals\n"
      "A row that is short does not change the exit code; work that differs from the rival's does (1).\n");
  command->runs(chosen, [repetitions, &common] { return perf::run(common, *repetitions); });
}

}  // namespace palpate

// Contact, surface and whole frame beside OpenCV's CPU chain and FFTW, in one run. See perf/README.md for the
// method.
#include <sys/mman.h>

#include <cmath>
#include <cstdio>
#include <cstring>
#include <random>

#include "capture/files/output_file.h"
#include "capture/synthetic/synthetic.h"
#include "engine/base/mapped_pages.h"
#include "engine/gpu/commands.h"
#include "engine/gpu/context.h"
#include "engine/numeric/weighted_poisson.h"
#include "engine/stages/contact.h"
#include "engine/stages/elastic.h"
#include "engine/stages/gradient.h"
#include "engine/stages/skin.h"
#include "engine/stages/surface.h"
#include "engine/stages/weighted_surface.h"
#include "palpate/pipeline.h"
#include "perf/measure.h"
#include "perf/profile/scene.h"
#include "perf/rivals/forward_rival.h"
#include "perf/rivals/gradient_rival.h"
#include "perf/rivals/lump_scaling.h"
#include "perf/rivals/matching_rival.h"
#include "perf/rivals/modulus_trials.h"
#include "perf/rivals/rivals.h"
#include "perf/rivals/skin_rival.h"
#include "perf/rivals/spline_rival.h"
#include "perf/rivals/weighted_rival.h"
#include "perf/tools/program.h"
#include "viz/commands/options.h"
#include "viz/report/gnuplot.h"

namespace palpate::perf {
namespace {

class Bench {
 public:
  Bench(gpu::Context& context, int repetitions) : context_(context), repetitions_(repetitions) {}

  void contact(const Size& size) {
    Scene scene = scene_for(size, SyntheticMode::Lambert);
    Pipeline pipeline = make_pipeline(scene, static_cast<uint32_t>(Output::Force), SurfaceSolver::Live);
    OpenCvContact rival(scene.background, scene.sensor);
    const Work ours{"palpate", [&] { pipeline.process(scene.next()); }};
    add(compare("contact", size.text(), ours,
                {"OpenCV 8 bit", [&] { sink_ += rival.run_8bit(scene.next()); }}, repetitions_,
                inner(size, 20)));
    add(compare("contact", size.text(), ours,
                {"OpenCV float", [&] { sink_ += rival.run_float(scene.next()); }}, repetitions_,
                inner(size, 20)));
  }

  /// Several contacts told apart and followed, beside OpenCV's; and beside ours without that.
  void regions(const Size& size) {
    Scene scene = fingers_for(size, SyntheticMode::Lambert);
    Pipeline apart = make_pipeline(scene, Output::Force | Output::Contacts, SurfaceSolver::Live);
    Pipeline whole = make_pipeline(scene, static_cast<uint32_t>(Output::Force), SurfaceSolver::Live);
    OpenCvContact rival(scene.background, scene.sensor);
    const Work ours{"palpate", [&] { apart.process(scene.next()); }};
    add(compare("contact and regions", size.text(), ours,
                {"OpenCV 8 bit", [&] { sink_ += rival.run_regions(scene.next()); }}, repetitions_,
                inner(size, 20)));
    add(compare("contact and regions", size.text(), ours,
                {"contact alone", [&] { whole.process(scene.next()); }}, repetitions_, inner(size, 20)));
  }

  /// Contact alone, of frames that lie in a camera driver's buffers: read in place by the device, and copied
  /// to it by the processor.
  void upload(const Size& size) {
    for (const uint32_t bits : {8u, 16u}) {
      Scene scene = scene_for(size, SyntheticMode::Lambert, false, bits);
      std::vector<Frame> leased;
      for (const Frame& frame : scene.frames) leased.push_back(lease(frame));
      const auto pipeline = [&](Upload upload) {
        return make_pipeline(scene, static_cast<uint32_t>(Output::Force), SurfaceSolver::Live, upload);
      };
      Pipeline importing = pipeline(Upload::Import), copying = pipeline(Upload::Copy);
      size_t turn = 0;
      const auto next = [&]() -> const Frame& { return leased[turn++ % leased.size()]; };
      add(compare("upload " + std::to_string(bits) + " bit", size.text(),
                  {"read in place", [&] { importing.process(next()); }},
                  {"copy", [&] { copying.process(next()); }}, repetitions_, inner(size, 40)));
    }
  }

  /// Frames that are the change already and not filtered: the sums alone. Ours are of the thresholded image
  /// and come with the area's moments, the peak and the number of saturated pixels.
  void moments(const Size& size) {
    Scene scene = scene_for(size, SyntheticMode::Lambert);
    for (Frame& frame : scene.frames)
      for (size_t i = 0; i < frame.bytes.size(); ++i)
        frame.bytes[i] -= std::min(frame.bytes[i], scene.background.bytes[i]);
    scene.sensor.reconstruction = Reconstruction::None;
    scene.sensor.filter = Filter::None;
    scene.sensor.background = {BackgroundKind::None, "", 1};
    std::fill(scene.background.bytes.begin(), scene.background.bytes.end(), uint8_t{0});
    const FrameFormat& format = scene.background.format;
    const Contact contact(context_, scene.sensor, format, false, load_tuning(context_).tuning);
    PaddedImage image(context_, "frame", format);
    image.write(scene.frames.front());
    const gpu::DeviceBuffer records(context_, "records", contact.record_bytes(), gpu::Memory::Readback);
    gpu::Commands upload(context_), commands(context_);
    upload.begin();
    image.record(upload);
    upload.end();
    upload.submit();
    upload.wait();
    commands.begin();
    contact.record(commands, image, image, records);
    commands.host_barrier();
    commands.end();
    const Work rival{"cv::moments", [&] { sink_ += opencv_moments(scene.frames.front()); }};
    add(compare("moments", size.text(),
                {"palpate",
                 [&] {
                   commands.submit();
                   commands.wait();
                   records.invalidate();
                   sink_ += static_cast<double>(contact.sum(records.as<const shared::ContactRecord>()).gray);
                 }},
                rival, repetitions_, inner(size, 40)));
    Pipeline pipeline = make_pipeline(scene, static_cast<uint32_t>(Output::Force), SurfaceSolver::Live);
    add(compare("moments of a frame", size.text(),
                {"palpate", [&] { pipeline.process(scene.frames.front()); }}, rival, repetitions_,
                inner(size, 40)));
  }

  void surface(const Size& size) {
    const Surface surface(context_, size.width, size.height, SurfaceSolver::Live,
                          load_tuning(context_).tuning);
    const FloatMap depth(context_, "depth", surface.grid());
    std::vector<float> right(size_t{size.width} * size.height), z(right.size());
    std::mt19937 random(1);
    for (float& f : right) f = std::normal_distribution<float>(0, 1)(random);
    gpu::Commands commands(context_);
    commands.begin();
    surface.record(commands, depth);
    commands.end();
    const Work ours{"palpate", [&] {
                      commands.submit();
                      commands.wait();
                    }};
    FftwPoisson exact(size.width, size.height, size.width, size.height);
    add(compare("surface", size.text(), ours, {"FFTW", [&] { exact.solve(right.data(), z.data()); }},
                repetitions_, inner(size, 8)));
    if (size.padded_width == size.width && size.padded_height == size.height) return;
    FftwPoisson padded(size.width, size.height, size.padded_width, size.padded_height);
    add(compare("surface", size.text(), ours, {"FFTW padded", [&] { padded.solve(right.data(), z.data()); }},
                repetitions_, inner(size, 8)));
  }

  /// Slopes of which a tenth is unknown, to heights: beside the solver without weights, and beside Eigen's
  /// direct one.
  void weighted(const Size& size) {
    const size_t cells = size_t{size.width} * size.height;
    std::mt19937 random(1);
    std::vector<float> slopes(2 * cells), weights(cells);
    for (float& slope : slopes) slope = std::normal_distribution<float>(0, 1)(random);
    for (float& weight : weights) weight = random() % 10 == 0 ? 0.0f : 1.0f;
    const Surface plain(context_, size.width, size.height, SurfaceSolver::Live, load_tuning(context_).tuning);
    const FloatMap depth(context_, "depth", plain.grid());
    const gpu::DeviceBuffer scalars(context_, "scalars", WeightedSurface::scalar_bytes(),
                                    gpu::Memory::Readback);
    gpu::Commands without(context_);
    without.begin();
    plain.record(without, depth);
    without.end();
    const WeightedFaces faces = weighted_faces(slopes, weights, size.width, size.height);
    for (const uint32_t iterations :
         {WeightedSurface::kLiveIterations, WeightedSurface::kConvergedIterations}) {
      const WeightedSurface surface(context_, size.width, size.height, 1, iterations);
      const auto upload = [&](const auto& value) {
        gpu::DeviceBuffer buffer(context_, "upload", surface.grid().bytes(), gpu::Memory::Upload);
        for (size_t i = 0; i < cells; ++i)
          buffer.as<float>()[i / size.width * surface.grid().pitch * 4 + i % size.width] = value(i);
        buffer.flush();
        return buffer;
      };
      const auto p = upload([&](size_t i) { return slopes[2 * i]; });
      const auto q = upload([&](size_t i) { return slopes[2 * i + 1]; });
      const auto w = upload([&](size_t i) { return weights[i]; });
      gpu::Commands with(context_);
      with.begin();
      with.copy(p, surface.slope_x().buffer, p.bytes());
      with.copy(q, surface.slope_y().buffer, q.bytes());
      with.copy(w, surface.weights().buffer, w.bytes());
      with.barrier();
      surface.record(with, depth, scalars);
      with.host_barrier();
      with.end();
      const bool live = iterations == WeightedSurface::kLiveIterations;
      const Work ours{"palpate", [&] {
                        with.submit();
                        with.wait();
                      }};
      const Work unweighted{"no weights", [&] {
                              without.submit();
                              without.wait();
                            }};
      const Work eigen{"Eigen LDLT", [&] { sink_ += solve_with_eigen(faces).front(); }};
      if (live)
        add(compare("weighted surface (live)", size.text(), ours, unweighted, repetitions_, inner(size, 8)));
      if (!live) add(compare("weighted surface (converged)", size.text(), ours, eigen, 3, 1));
      const WeightedStatistics statistics = WeightedSurface::statistics(scalars);
      std::printf("  %u iterations, residual %.1e\n", statistics.iterations, statistics.residual);
    }
  }

  /// Pressure to deflection on a bonded layer, as the waveguide scenes have it.
  void elastic(const Size& size) {
    SyntheticOptions options;
    options.width = size.width;
    options.height = size.height;
    const Sensor sensor = synthetic_sensor(options);
    const ElasticKernel kernel(sensor.elastic, sensor.pitch_mm_per_px);
    const Elastic stage(context_, kernel, size.width, size.height, load_tuning(context_).tuning);
    const FloatMap depth(context_, "depth", stage.grid());
    std::vector<float> pressure(size_t{size.width} * size.height), deflection(pressure.size());
    std::mt19937 random(1);
    for (float& p : pressure) p = std::uniform_real_distribution<float>(0, 0.1f)(random);
    const gpu::DeviceBuffer staging(context_, "pressure", stage.pressure().bytes(), gpu::Memory::Upload);
    const std::span<float> padded = staging.as<float>();
    std::fill(padded.begin(), padded.end(), 0.0f);
    for (size_t y = 0; y < size.height; ++y)
      std::copy_n(
          pressure.begin() + static_cast<std::ptrdiff_t>(y * size.width), size.width,
          padded.begin() + static_cast<std::ptrdiff_t>(stage.pressure_start() + y * stage.pressure_pitch()));
    staging.flush();
    gpu::Commands upload(context_), commands(context_);
    upload.begin();
    upload.copy(staging, stage.pressure(), staging.bytes());
    upload.end();
    upload.submit();
    upload.wait();
    commands.begin();
    stage.record_deflection(commands, depth);
    commands.end();
    FftwElastic rival(kernel, size.width, size.height);
    add(compare("elastic", size.text(),
                {"palpate",
                 [&] {
                   commands.submit();
                   commands.wait();
                 }},
                {"FFTW zero-padded", [&] { rival.solve(pressure.data(), deflection.data()); }}, repetitions_,
                inner(size, 8)));
  }

  void frame(const Size& size, SyntheticMode mode) {
    Scene scene = scene_for(size, mode);
    const std::string work = "frame to height (" + std::string(to_string(scene.sensor.reconstruction)) + ")";
    Pipeline pipeline = make_pipeline(scene, Output::Force | Output::Surface, SurfaceSolver::Live);
    OpenCvFftwFrame rival(scene.background, scene.sensor, size.padded_width, size.padded_height);
    add(compare(work, size.text(), {"palpate", [&] { pipeline.process(scene.next()); }},
                {"OpenCV + FFTW", [&] { sink_ += rival.run(scene.next()); }}, repetitions_, inner(size, 8)));
    stages(pipeline, scene, size, work);
  }

  /// What a table over the linear normal costs, over the same frame without.
  void normal_table(const Size& size) {
    Scene scene = scene_for(size, SyntheticMode::Gel);
    Pipeline plain = make_pipeline(scene, Output::Force | Output::Surface, SurfaceSolver::Live);
    constexpr uint32_t kSide = 17;
    NormalTable& table = scene.sensor.photometric.table.emplace();
    table.side = kSide;
    for (uint32_t n = 0; n < kSide * kSide; ++n) {
      const uint32_t column = n % kSide, row = n / kSide;
      table.nx.push_back(2.0 * column / (kSide - 1) - 1);
      table.ny.push_back(2.0 * row / (kSide - 1) - 1);
    }
    Pipeline with = make_pipeline(scene, Output::Force | Output::Surface, SurfaceSolver::Live);
    add(compare("normal table", size.text(), {"with", [&] { with.process(scene.next()); }},
                {"without", [&] { plain.process(scene.next()); }}, repetitions_, inner(size, 8)));
  }

  /// A gray gel's depth by table, frame to depth, beside OpenCV's difference, filter and table.
  void lookup(const Size& size) {
    Scene scene = scene_for(size, SyntheticMode::Lambert);
    scene.sensor.reconstruction = Reconstruction::Lookup;
    scene.sensor.lookup.points = {{4, 0}, {60, 0.8}, {120, 1.2}, {200, 1.5}};
    Pipeline pipeline = make_pipeline(scene, Output::Force | Output::Surface, SurfaceSolver::Live);
    add(compare("frame to depth (lookup)", size.text(), {"palpate", [&] { pipeline.process(scene.next()); }},
                {"OpenCV", [&] { sink_ += opencv_lookup(scene.next(), scene.background); }}, repetitions_,
                inner(size, 8)));
  }

  /// The pattern of the skin, followed through a twist; with each one's error against the truth.
  void skin(const Size& size, const char* pattern) {
    const SyntheticOptions options =
        parse_synthetic("synthetic:twist?size=" + size.text() + "&skin=" + pattern + "&mode=gel");
    const SyntheticSensor source(options);
    const Sensor sensor = synthetic_sensor(options);
    const Frame untouched = *source.own_background();
    Skin stage(context_, sensor, source.format());
    stage.set_background(untouched);
    std::vector<std::array<float, 2>> points;
    for (const SkinTemplate& t : stage.templates()) points.push_back(t.centre);
    const auto side_px = static_cast<int>(2 * stage.window().reach_px() + 1);
    OpenCvSkin rival(untouched, points, side_px);

    std::vector<Frame> frames;
    std::vector<PaddedImage> images;
    std::vector<gpu::Commands> commands;
    const gpu::DeviceBuffer records(context_, "records", stage.record_bytes(), gpu::Memory::Readback);
    constexpr uint64_t kFirst = 45, kFrames = 40;
    for (uint64_t k = 0; k < kFrames; ++k) {
      source.render(kFirst + k, frames.emplace_back());
      images.emplace_back(context_, "frame", source.format()).write(frames.back());
      gpu::Commands& one = commands.emplace_back(context_);
      one.begin();
      images.back().record(one);
      one.barrier();
      stage.record(one, images.back(), records);
      one.host_barrier();
      one.end();
    }
    // There and back: the skin never jumps.
    const auto place = [](size_t turn) {
      return turn % (2 * kFrames) < kFrames ? turn % kFrames : kFrames - 1 - turn % kFrames;
    };
    size_t turn = 0, rival_turn = 0;
    const auto follow = [&] {
      gpu::Commands& one = commands[place(turn++)];
      one.submit();
      one.wait();
      records.invalidate();
    };
    add(compare(
        std::string("skin (") + pattern + ", " + std::to_string(points.size()) + ")", size.text(),
        {"palpate", follow},
        {"calcOpticalFlowPyrLK", [&] { sink_ += double{rival.follow(frames[place(rival_turn++)])[0][0]}; }},
        repetitions_, inner(size, 8)));
    double ours = 0, theirs = 0, ours_count = 0, theirs_count = 0;
    for (turn = rival_turn = 0; turn < kFrames;) {
      const uint64_t sequence = kFirst + turn;
      follow();
      const auto motions = records.as<const Skin::Motion>();
      const auto& places = rival.follow(frames[place(rival_turn++)]);
      for (size_t i = sequence % 31; i < points.size(); i += 31) {
        const auto truth = source.skin_shift_px(sequence, double{points[i][0]}, double{points[i][1]});
        const auto square = [&](double x, double y) {
          return (std::pow(x - truth[0], 2) + std::pow(y - truth[1], 2)) / 2;
        };
        if (motions[i].correlation > 0) {
          ours += square(double{motions[i].shift_x_px}, double{motions[i].shift_y_px});
          ++ours_count;
        }
        if (places[i][0] == places[i][0]) {
          theirs += square(double{places[i][0]} - double{points[i][0]},
                           double{places[i][1]} - double{points[i][1]});
          ++theirs_count;
        }
      }
    }
    std::printf("  RMS error of one component: palpate %.3f px, calcOpticalFlowPyrLK %.3f px\n",
                std::sqrt(ours / ours_count), std::sqrt(theirs / theirs_count));
  }

  /// The sum of gradients of a pressed gel.
  void gradient(const Size& size) {
    Scene scene = scene_for(size, SyntheticMode::Gel);
    const FrameFormat& format = scene.background.format;
    const Gradient stage(context_, scene.sensor, format);
    const OpenCvGradient rival(scene.background);
    const gpu::DeviceBuffer sums(context_, "sums", stage.record_bytes(), gpu::Memory::Readback);
    PaddedImage rest(context_, "background", format), image(context_, "frame", format);
    rest.write(scene.background);
    const Frame& frame = scene.next();
    image.write(frame);
    gpu::Commands upload(context_), commands(context_);
    upload.begin();
    rest.record(upload);
    image.record(upload);
    upload.end();
    upload.submit();
    upload.wait();
    commands.begin();
    stage.record(commands, image, rest, sums);
    commands.host_barrier();
    commands.end();
    double ours = 0, theirs = 0;
    const auto sum = [&] {
      commands.submit();
      commands.wait();
      sums.invalidate();
      ours = static_cast<double>(stage.sum(sums.as<const uint32_t>())) / shared::kGradientUnits;
    };
    const double limit = scene.sensor.gradient_gray_per_px;
    add(compare("gradient", size.text(), {"palpate", sum},
                {"OpenCV Sobel", [&] { theirs = rival.run(frame, limit); }}, repetitions_, inner(size, 10)));
    std::printf("  sums %.1f and %.1f gray levels x px\n", ours, theirs);
  }

  /// Frames a second with several frames in flight, as `palpate process` runs.
  void throughput(const Size& size, SyntheticMode mode) {
    Scene scene = scene_for(size, mode);
    Pipeline pipeline = make_pipeline(scene, Output::Force | Output::Surface, SurfaceSolver::Live);
    constexpr int kFrames = 150;
    const auto start = std::chrono::steady_clock::now();
    for (int i = 0; i < kFrames; ++i) {
      while (!pipeline.submit(scene.next())) pipeline.wait();
    }
    while (pipeline.wait()) {
    }
    const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    throughput_csv_ += std::string(to_string(scene.sensor.reconstruction)) + "," + size.text() + "," +
                       std::to_string(std::lround(kFrames / seconds)) + "\n";
    std::printf("throughput, %s, %s: %.1f frames/s\n", to_string(scene.sensor.reconstruction),
                size.text().c_str(), kFrames / seconds);
  }

  const std::string& csv() const { return csv_; }
  const std::string& throughput_csv() const { return throughput_csv_; }

  /// The forward model's equations, device beside processor.
  void forward(uint32_t along) {
    ForwardRival pair(context_, along);
    const int inner = std::max(1, static_cast<int>(20 * 64 * 64 * 64 / (along * along * along)));
    add(pair.product(repetitions_, inner));
    add(pair.wide_product(repetitions_, inner));
    add(pair.cycle(std::min(repetitions_, 7), 1));
    add(pair.solve(std::min(repetitions_, 5)));
    std::printf("  iterations: device %u, processor %u\n", pair.device_iterations(),
                pair.processor_iterations());
  }

 private:
  /// The frame as a camera driver would hand it out: in pages mapped for it alone.
  static Frame lease(const Frame& frame) {
    const size_t bytes = frame.format.frame_bytes();
    void* memory = mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    if (memory == MAP_FAILED) throw std::bad_alloc();
    std::memcpy(memory, frame.pixels(), bytes);
    const auto* pixels = static_cast<const uint8_t*>(memory);
    Frame leased;
    leased.format = frame.format;
    leased.pages = std::make_shared<MappedPages>(pixels, bytes, [=] { munmap(memory, bytes); });
    leased.leased = {leased.pages, pixels};
    return leased;
  }

  Pipeline make_pipeline(const Scene& scene, uint32_t outputs, SurfaceSolver solver,
                         Upload upload = Upload::Auto) {
    PipelineOptions options;
    options.outputs = outputs;
    options.upload = upload;
    options.solver = solver;
    Pipeline pipeline(context_, scene.sensor, scene.background.format, options);
    pipeline.set_background(scene.background);
    return pipeline;
  }

  /// Runs in one sample, `at_vga` of them at 640 x 480: enough that the caches are warm with the work itself,
  /// as they are when a recording runs through, and not with what the rival left.
  static int inner(const Size& size, int at_vga) {
    return std::max(3, static_cast<int>(at_vga * 307200 / (size.width * size.height)));
  }

  void stages(Pipeline& pipeline, Scene& scene, const Size& size, const std::string& work) {
    if (!context_.timers()) return;
    pipeline.submit(scene.next());
    const auto result = pipeline.wait();
    std::printf("  stages of %s, %s:", work.c_str(), size.text().c_str());
    for (const gpu::ScopeTime& t : pipeline.times(*result)) std::printf(" %s %.2f ms", t.name.c_str(), t.ms);
    std::printf("\n");
  }

  void add(const Pair& p) {
    csv_ += csv_row(p);
    std::printf(
        "%-30s %-10s palpate %7.2f ms (p95 %7.2f, cpu %7.2f)  %-13s %7.2f ms (p95 %7.2f, cpu %7.2f)  ratio "
        "wall %.2f cpu %.2f\n",
        p.work.c_str(), p.size.c_str(), p.ours.wall_ms.median, p.ours.wall_ms.p95, p.ours.cpu_ms.median,
        p.rival.name.c_str(), p.rival.wall_ms.median, p.rival.wall_ms.p95, p.rival.cpu_ms.median,
        p.wall_ratio, p.cpu_ratio);
    std::fflush(stdout);
  }

  gpu::Context& context_;
  int repetitions_;
  double sink_ = 0;
  std::string csv_ = csv_header();
  std::string throughput_csv_ = "reading,size,frames_per_s\n";
};

/// Samples from 5 kPa to 5 MPa of every shape, each at several seeds; and the paper's case, two presses.
void modulus(gpu::Context& context, const std::string& out, int seeds) {
  constexpr int kModuli = 13, kPresses = 6, kNodes = 50;
  std::vector<ModulusTrial> trials, paper;
  for (const SampleShape shape : {SampleShape::Cube, SampleShape::Cylinder, SampleShape::Sphere}) {
    for (int i = 0; i < kModuli; ++i)
      for (int seed = 1; seed <= seeds; ++seed) {
        const double young_MPa = 0.005 * std::pow(1000, i / (kModuli - 1.0));
        for (ModulusTrial& t : modulus_trial(
                 context, shape, young_MPa,
                 uint64_t{100} * static_cast<uint64_t>(seed) + static_cast<uint64_t>(i), kPresses, kNodes))
          trials.push_back(std::move(t));
      }
    std::printf("%s done\n", to_string(shape));
    std::fflush(stdout);
  }
  for (int seed = 1; seed <= 10; ++seed)
    for (ModulusTrial& t :
         modulus_trial(context, SampleShape::Cube, 0.103, {0.8, 1.0}, static_cast<uint64_t>(seed), kNodes))
      paper.push_back(std::move(t));
  std::printf("%s\nthe paper's case, a cube of 103 kPa at 0.8 and 1.0 N, ten times:\n",
              scores_text(trials).c_str());
  for (const bool stage : {true, false}) {
    std::vector<ModulusTrial> some;
    for (const ModulusTrial& t : paper)
      if (t.stage == stage) some.push_back(t);
    const ModulusScore s = score(some, 0.01, 1);
    std::printf("  stage %s: %zu of %zu valid, median error %.1f %%, 90th percentile %.1f %%, inside %zu\n",
                stage ? "known" : "not known", s.valid, s.trials, 100 * s.median, 100 * s.ninety, s.inside);
  }
  if (out.empty()) return;
  write_whole(out + "/trials.csv", std::string_view(trials_csv(trials)));
  write_whole(out + "/cl2000x.csv", std::string_view(trials_csv(paper)));
  write_whole(out + "/scores.txt", std::string_view(scores_text(trials)));
  for (const bool svg : {false, true}) {
    const Picture picture = run_gnuplot(trials_script(trials, svg));
    if (picture.bytes.empty())
      std::printf("no plot: %s\n", picture.error.c_str());
    else
      write_whole(out + (svg ? "/trials.svg" : "/trials.png"), std::string_view(picture.bytes));
  }
}

int run(int argc, char** argv) {
  CommandLine app("Times palpate's stages beside OpenCV and FFTW in one run.");
  gpu::ContextOptions options;
  int repetitions = 21, seeds = 2;
  bool weighted = false, contacts = false, skin = false, gels = false, forward = false, splines = false;
  bool moduli = false, matching = false, lumps = false;
  std::string out;
  app.add_option("--device", options.device, "index or part of a name");
  app.add_option("--repetitions", repetitions, "paired repetitions")->check(Check::range(3, 1000));
  app.add_option(
      "--out", out,
      "existing folder for the CSV files: bench.csv and throughput.csv, or one named by what is asked for");
  app.add_flag("--stages", options.timers,
               "GPU timers for single stages (they slow the frame down by a tenth)");
  app.add_flag("--weighted", weighted, "Weighted surfaces only: their rival takes half a minute");
  app.add_flag("--gels", gels,
               "Gels only: sum of gradients, readings with a normal table and by a table of depth");
  app.add_flag("--skin", skin, "Following the skin's pattern only");
  app.add_flag("--forward", forward, "The forward model's product and solve only");
  app.add_flag("--splines", splines, "Thin-plate splines only: error and time by points, kernel and lambda");
  app.add_flag("--matching", matching, "Matching of point sets beside Coherent Point Drift only: no device");
  app.add_flag("--lump-scaling", lumps,
               "Data sets of lumps only: cases a minute by threads and processes, beyond that a model");
  app.add_flag("--contacts", contacts, "Contact, regions and moments only");
  app.add_flag("--modulus", moduli,
               "Errors and intervals of Young's modulus of simulated samples, nothing timed");
  app.add_option("--seeds", seeds, "samples of each shape and modulus, with --modulus")
      ->check(Check::range(1, 100));
  if (const std::optional<int> code = app.parse_or_exit(argc, argv)) return *code;

  const auto write = [&](const std::string& name, const std::string& text) {
    OutputFile file(out + "/" + name);
    file.write(text);
    file.commit();
  };
  if (splines) {
    const SplineStudy study = spline_study(std::min(repetitions, 5));
    std::printf("%s", study.words.c_str());
    if (out.empty()) return 0;
    write("splines.csv", study.csv);
    if (!study.png.empty()) write("splines.png", study.png);
    return 0;
  }
  if (lumps) {
    const std::filesystem::path self = std::filesystem::read_symlink("/proc/self/exe");
    const LumpScaling study = lump_scaling(self.parent_path() / "palpate");
    std::printf("%s", study.words.c_str());
    if (out.empty()) return 0;
    write("scaling.csv", study.csv);
    write("scaling.txt", study.words);
    if (!study.png.empty()) write("scaling.png", study.png);
    if (!study.svg.empty()) write("scaling.svg", study.svg);
    return 0;
  }
  if (matching) {
    const std::string csv = compare_matching(repetitions);
    if (!out.empty()) write("matching.csv", csv);
    return 0;
  }
  gpu::Context context(options);
  std::printf("%s, %s\n", context.report().name.c_str(), context.report().driver.c_str());
  if (moduli) {
    modulus(context, out, seeds);
    return 0;
  }
  Bench bench(context, repetitions);
  const Size sizes[] = {{640, 480, 640, 480}, {1392, 1042, 1400, 1050}};
  if (forward)
    for (const uint32_t along : {32u, 64u, 96u}) bench.forward(along);
  for (const Size& size : sizes) {
    if (forward) break;
    if (weighted) {
      bench.weighted(size);
      continue;
    }
    if (gels) {
      bench.gradient(size);
      bench.normal_table(size);
      bench.lookup(size);
      continue;
    }
    if (skin) {
      bench.skin(size, "markers");
      bench.skin(size, "texture");
      continue;
    }
    bench.contact(size);
    bench.regions(size);
    bench.moments(size);
    if (contacts) continue;
    bench.upload(size);
    bench.surface(size);
    bench.elastic(size);
    bench.frame(size, SyntheticMode::Lambert);
    bench.frame(size, SyntheticMode::Gel);
    bench.normal_table(size);
    bench.lookup(size);
    bench.throughput(size, SyntheticMode::Lambert);
    bench.throughput(size, SyntheticMode::Gel);
  }
  if (!out.empty()) {
    const bool all = !weighted && !forward && !skin && !gels && !contacts;
    write(forward    ? "forward.csv"
          : weighted ? "weighted.csv"
          : skin     ? "skin.csv"
          : gels     ? "gels.csv"
          : contacts ? "contacts.csv"
                     : "bench.csv",
          bench.csv());
    if (all) write("throughput.csv", bench.throughput_csv());
  }
  return 0;
}

}  // namespace
}  // namespace palpate::perf

int main(int argc, char** argv) {
  return palpate::perf::run_program("palpate_bench", palpate::perf::run, argc, argv);
}

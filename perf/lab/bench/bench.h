// Pairs of palpate's work and a rival's, by subject; bench_*.cpp.
#pragma once

#include <filesystem>
#include <map>
#include <string>

#include "engine/gpu/context.h"
#include "palpate/pipeline.h"
#include "perf/measure.h"
#include "perf/profile/scene.h"

namespace palpate::perf {

/// Times pairs one after another, prints each and keeps them as rows of a table.
class Bench {
 public:
  Bench(gpu::Context& context, int repetitions) : context_(context), repetitions_(repetitions) {}

  // Contact (bench_contact.cpp).
  void contact(const Size& size);
  /// Several contacts separated and followed, against OpenCV's and ours without that.
  void regions(const Size& size);
  /// Contact alone, of frames that lie in a camera driver's buffers: read in place by the device, and copied
  /// to it by the processor.
  void upload(const Size& size);
  /// Frames that are the change already and not filtered: the sums alone. Ours are of the thresholded image
  /// and come with the area's moments, the peak and the number of saturated pixels.
  void moments(const Size& size);

  // Solvers (bench_solvers.cpp).
  void surface(const Size& size);
  /// Slopes of which a tenth is unknown, to heights: against the solver without weights, and against Eigen's
  /// direct one.
  void weighted(const Size& size);
  /// Pressure to deflection on a bonded layer, as the waveguide scenes have it.
  void elastic(const Size& size);
  /// The forward model's equations, device against processor.
  void forward(uint32_t along);

  // Whole frames (bench_frames.cpp).
  void frame(const Size& size, SyntheticMode mode);
  /// Cost of each model's weights, over the same frame with linear ones.
  void place_weights(const Size& size);
  /// A gray gel's depth by table, frame to depth, against OpenCV's difference, filter and table.
  void lookup(const Size& size);
  /// Frames a second with several frames in flight, as `palpate process` runs.
  void throughput(const Size& size, SyntheticMode mode);

  // Gels: skin and gradients (bench_gels.cpp).
  /// The pattern of the skin, followed through a twist; with each one's error against the truth.
  void skin(const Size& size, const char* pattern);
  /// The sum of gradients of a pressed gel.
  void gradient(const Size& size);

  const std::string& csv() const { return csv_; }
  const std::string& throughput_csv() const { return throughput_csv_; }

 private:
  Pipeline make_pipeline(const Scene& scene, Outputs outputs, SurfaceSolver solver,
                         Upload upload = Upload::Auto);
  /// Runs in one sample, `at_vga` of them at 640 x 480: enough that the caches are warm with the work itself,
  /// as they are when a recording runs through, and not with what the rival left.
  static int inner(const Size& size, int at_vga);
  void stages(Pipeline& pipeline, Scene& scene, const Size& size, const std::string& work);
  void add(const Pair& p);

  gpu::Context& context_;
  int repetitions_;
  double sink_ = 0;  ///< keeps results that nothing else uses
  std::string csv_ = csv_header();
  std::string throughput_csv_ = "reading,size,frames_per_s\n";
};

/// Samples from 5 kPa to 5 MPa of every shape, each at several seeds; and the paper's case, two presses.
/// Plots go to the folder `out` unless it is empty. Returns tables by the names of their files.
std::map<std::string, std::string> modulus_study(gpu::Context& context, const std::filesystem::path& out,
                                                 int seeds);

}  // namespace palpate::perf

#include <gtest/gtest.h>
#include <cmath>
#include <cstdio>
#include "tests/gpu_fixture.h"
#include "viz/modulus_frames.h"
#include "viz/modulus_simulation.h"
namespace palpate { namespace {
class ModulusImage : public GpuTest {};
TEST_F(ModulusImage, Study) {
  for (const auto shape : {SampleShape::Cylinder, SampleShape::Cube, SampleShape::Sphere})
    for (const double young : {0.01, 0.103, 1.0}) {
      ModulusScene s;
      s.sample = {shape, shape == SampleShape::Sphere ? 16.0 : 10.0, 10, 0.5, 0.002, Support::Sliding};
      s.young_MPa = young;
      s.forces_N.clear();
      const PressModel model({{0.2, 0.5}, 6, Base::Bonded}, s.sample);
      double top = 2.0;
      for (; top > 1e-4; top *= 0.95) { const auto q = model.at_force(top, young, 0.2); if (s.sample.flat() ? q.strain < 0.09 : q.radius_mm < 0.38 * 8) break; }
      for (int i = 2; i <= 10; ++i) s.forces_N.push_back(top * i / 10);
      s.sensor.mode = SyntheticMode::Waveguide;
      const SimulatedPresses p = simulate_presses(s);
      PressReader reader(context(), p.sensor, p.background, s.sample);
      std::vector<PressFrame> frames, blind;
      for (size_t i = 0; i < p.frames.size(); ++i) {
        auto f = reader.read(p.frames[i]);
        if (!f) { std::printf("none: %s\n", reader.why_not().c_str()); continue; }
        std::printf("F %.4f %.4f radius %.4f truth edge %.4f depth %.4f %.4f mean %.4f %.4f\n", f->force_N, p.truth[i].force_N, f->radius_mm.value, p.truth[i].r_mm.back(), f->depth_mm.value, p.truth[i].depth_mm, f->mean_depth_mm.value, p.truth[i].mean_depth_mm);
        blind.push_back(*f);
        f->approach_mm = {p.approach_mm[i], 0.005};
        frames.push_back(*f);
      }
      ModulusSetup setup;
      setup.pad = {{0.2, 0.5}, 6, Base::Bonded};
      setup.sample = s.sample;
      setup.pad_relative_sd = setup.force_relative_sd = 0.01;
      setup.depth_by_pressure = true;
      for (const auto& fr : {frames, blind}) {
        const auto a = estimate_modulus(fr, setup);
        std::printf("%s %g kPa: chosen %s\n", to_string(shape), 1e3 * young, to_string(a.chosen));
        for (const auto& e : a.ways)
          std::printf("   %-20s %-14s %.4g (%+.1f %%) [%.4g %.4g] res %.2f %s\n", to_string(e.way), to_string(e.state), 1e3 * e.young_MPa, 100 * (e.young_MPa / young - 1), 1e3 * e.low_MPa, 1e3 * e.high_MPa, e.residual, e.reason.c_str());
      }
    }
}
}}

// Profiles of machines that do not exist, and checks that hold for every report.
#pragma once

#include <gtest/gtest.h>

#include <string>

#include "perf/profile/growth.h"
#include "perf/profile/profile.h"
#include "perf/profile/sampling.h"
#include "tests/support/program_fixture.h"

namespace palpate::perf {

inline Distribution around(double median_ms) {
  return {20,
          0.8 * median_ms,
          0.9 * median_ms,
          median_ms,
          1.1 * median_ms,
          1.4 * median_ms,
          1.5 * median_ms,
          2 * median_ms};
}

inline SizeFigure size_figure(uint32_t width_px, uint32_t height_px, double frame_ms) {
  SizeFigure size;
  size.reading = "shading";
  size.width_px = width_px;
  size.height_px = height_px;
  size.latency = around(frame_ms);
  size.histogram = histogram_of({0.9 * frame_ms, frame_ms, 1.1 * frame_ms}, 4);
  size.cpu_ms = 1.5 * frame_ms;
  size.frames_per_s = 1200 / frame_ms;
  size.memory_bytes = uint64_t{30} * width_px * height_px;
  size.setup_ms = 100;
  StageFigure stage;
  stage.stage = "contact";
  stage.time = around(0.3 * frame_ms);
  stage.read_bytes = uint64_t{2} * width_px * height_px;
  stage.written_bytes = 1000;
  stage.dispatches = 1;
  stage.GB_per_s = 3;
  stage.ceiling_fraction = 0.3;
  size.stages = {stage};
  return size;
}

/// A whole profile whose frames take `slowness` ms at 640 x 480.
inline Profile made_up(const std::string& device, double slowness) {
  Profile profile;
  profile.complete = true;
  profile.budget_s = 10;
  profile.elapsed_s = 9;
  profile.machine.device = device;
  profile.machine.palpate = "0.1.0";
  profile.machine.cpu = "some CPU";
  profile.machine.driver = "driver 1";
  profile.ceiling = {{{1 << 20, 20, 15}, {64 << 20, 10, 9}}, 10, "GPU", 0.98, 0.1};
  profile.sizes = {size_figure(640, 480, slowness), size_figure(1280, 960, 4 * slowness)};
  profile.growth = growth_of(profile.sizes);
  SolverFigure solver;
  solver.truth = "smooth";
  solver.width_px = 640;
  solver.height_px = 480;
  solver.solver = "live";
  solver.where = "GPU";
  solver.relative_rms_error = 1e-4;
  solver.peak_to_valley_error = 2e-4;
  solver.time = around(slowness / 2);
  solver.on_front = true;
  profile.solvers = {solver};
  OutputFigure output;
  output.outputs = "force only (10 % touched)";
  output.reading = "shading";
  output.width_px = 640;
  output.height_px = 480;
  output.touched_fraction = 0.1;
  output.time = around(slowness / 5);
  output.cpu_ratio = 0.2;
  output.memory_bytes = 1000000;
  profile.outputs = {output};
  LiveFigure live;
  live.reading = "shading";
  live.width_px = 640;
  live.height_px = 480;
  live.rate_Hz = 60;
  live.frames = 120;
  live.dropped_before_display = 3;
  live.to_measured = around(2 * slowness);
  live.to_picture = around(5 * slowness);
  profile.live = {live};
  RateFigure rate;
  rate.scene = "gel: force";
  rate.width_px = 320;
  rate.height_px = 240;
  rate.rate_Hz = 480;
  rate.frames = 960;
  rate.dropped_before_engine = 4;
  rate.to_measured = around(slowness);
  rate.frames_per_s = 600 / slowness;
  profile.rates = {rate};
  PhotonFigure photon;
  photon.scene = "gel: surface";
  photon.width_px = 640;
  photon.height_px = 480;
  photon.rate_Hz = 30;
  photon.frames = 90;
  photon.to_measured = around(slowness);
  photon.to_picture = around(3 * slowness);
  photon.waits_ms = slowness / 2;
  photon.frames_per_s = 500 / slowness;
  photon.parts = {{"capture", "capture", "capture", around(0.1 * slowness), 0.1 * slowness, 0.01},
                  {"drawing", "draw", "draw", around(slowness), slowness, 0.1},
                  {"engine", "submit", "light", around(0.2 * slowness), 0.2 * slowness, 0.02},
                  {"engine", "device", "device wait", around(0.7 * slowness), 0.7 * slowness, 0.07}};
  profile.photon = {photon};
  profile.skipped = {{"8192 x 8192, shading", "needs about 24 s"}};
  return profile;
}

/// No way out of the page: nothing is loaded, nothing runs.
inline void expect_self_contained(const std::string& html) {
  for (const char* way :
       {"src=", "<script", "<link", "@import", "url(http", "<iframe", "file:/", "/home/", "/tmp/"})
    EXPECT_FALSE(contains(html, way)) << way;
  for (size_t at = html.find("href="); at != std::string::npos; at = html.find("href=", at + 1))
    EXPECT_EQ(html[at + 6], '#') << html.substr(at, 60);  // only to shapes of the same picture
  EXPECT_TRUE(contains(html, "</html>"));
}

}  // namespace palpate::perf

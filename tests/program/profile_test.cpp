// palpate profile: the arithmetic on known data, and a small run on a real device.
#include "perf/profile/profile.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <set>

#include "engine/gpu/context.h"
#include "palpate/error.h"
#include "perf/profile/growth.h"
#include "perf/profile/photon.h"
#include "perf/profile/rates.h"
#include "perf/profile/report/answers.h"
#include "perf/profile/report/compare.h"
#include "perf/profile/report/files.h"
#include "perf/profile/report/report.h"
#include "perf/profile/report/tables.h"
#include "perf/profile/run.h"
#include "perf/profile/solvers.h"
#include "perf/profile/truths.h"
#include "tests/program/made_up_profile.h"
#include "tests/support/json.h"
#include "tests/support/program_fixture.h"
#include "viz/display/picture.h"
#include "viz/report/gnuplot.h"

namespace palpate::perf {
namespace {

TEST(Profile, PowerFitFindsExponentAndItsError) {
  const std::array<double, 5> x{1e4, 4e4, 3e5, 1.5e6, 6.7e7};
  std::array<double, 5> y{};
  for (size_t i = 0; i < x.size(); ++i) y[i] = 3e-5 * std::pow(x[i], 1.25);
  const PowerFit exact = fit_power(x, y);
  EXPECT_NEAR(exact.exponent, 1.25, 1e-12);
  EXPECT_NEAR(exact.constant, 3e-5, 1e-15);
  EXPECT_LT(exact.standard_error, 1e-12);

  // By hand: log x = 0, 1, 2 and log y = 0, 1.3, 2 give slope 1, left over (-0.1, 0.2, -0.1), so
  // s^2 = 0.06 / 1 and the slope's error sqrt(0.06 / 2).
  const std::array<double, 3> three{1, std::exp(1), std::exp(2)};
  const std::array<double, 3> noisy{1, std::exp(1.3), std::exp(2)};
  const PowerFit fit = fit_power(three, noisy);
  EXPECT_NEAR(fit.exponent, 1, 1e-12);
  EXPECT_NEAR(fit.standard_error, std::sqrt(0.06 / 2), 1e-12);
}

TEST(Profile, PowerFitRefusesWhatHasNoExponent) {
  const std::array<double, 2> same{5, 5}, good{1, 2}, negative{-1, 2};
  const std::array<double, 1> one{1};
  EXPECT_THROW(fit_power(same, good), std::invalid_argument);
  EXPECT_THROW(fit_power(good, negative), std::invalid_argument);
  EXPECT_THROW(fit_power(one, one), std::invalid_argument);
}

TEST(Profile, GrowthFitsLargeFramesApart) {
  // A fixed cost of 1 ms hides the growth of small frames.
  std::vector<SizeFigure> sizes;
  for (const uint32_t side : {64u, 128u, 1024u, 2048u, 4096u})
    sizes.push_back(size_figure(side, side, 1 + 1e-4 * side * side));
  const std::vector<Growth> growth = growth_of(sizes);
  ASSERT_EQ(growth.size(), 4u);  // frame and contact, all and large
  EXPECT_EQ(growth[0].stage, "frame");
  EXPECT_EQ(growth[0].sizes, 5u);
  EXPECT_LT(growth[0].exponent, 0.9);
  EXPECT_EQ(growth[1].from_px, kLargeFrame_px);
  EXPECT_EQ(growth[1].sizes, 3u);
  EXPECT_NEAR(growth[1].exponent, 1, 0.01);
}

TEST(Profile, FrontHoldsWhatNothingBeats) {
  const std::array<double, 6> time{1, 2, 3, 4, 1, 5};
  const std::array<double, 6> error{9, 4, 5, 1, 9, 1};
  // 3 is slower and worse than 2; 5 is slower than 4 and no better; two equal points both stay.
  EXPECT_EQ(pareto_front(time, error), (std::vector<bool>{true, true, false, true, true, false}));
  EXPECT_EQ(pareto_front({}, {}), std::vector<bool>{});
}

TEST(Profile, DistributionAndHistogramOfKnownSamples) {
  std::vector<double> samples;
  for (int i = 100; i >= 0; --i) samples.push_back(i + 1);
  const Distribution d = distribution_of(samples);
  EXPECT_EQ(d.samples, 101u);
  EXPECT_DOUBLE_EQ(d.min_ms, 1);
  EXPECT_DOUBLE_EQ(d.q25_ms, 26);
  EXPECT_DOUBLE_EQ(d.median_ms, 51);
  EXPECT_DOUBLE_EQ(d.p95_ms, 96);
  EXPECT_DOUBLE_EQ(d.p99_ms, 100);
  EXPECT_DOUBLE_EQ(d.max_ms, 101);
  const Histogram h = histogram_of(samples, 7);
  ASSERT_EQ(h.edges_ms.size(), 8u);
  ASSERT_EQ(h.counts.size(), 7u);
  uint64_t all = 0;
  for (size_t i = 0; i < h.counts.size(); ++i) {
    const auto inside = std::count_if(samples.begin(), samples.end(), [&](double s) {
      return s >= h.edges_ms[i] * (1 - 1e-12) && s < h.edges_ms[i + 1] * (1 - 1e-12);
    });
    EXPECT_EQ(h.counts[i], static_cast<uint64_t>(inside)) << "bin " << i;
    all += h.counts[i];
  }
  EXPECT_EQ(all, samples.size());
  EXPECT_EQ(histogram_of({2, 2, 2}, 3).counts, (std::vector<uint64_t>{3, 0, 0}));
}

TEST(Profile, LineIntegralIsExactOnAPlaneAndTruthsHaveTheirGradients) {
  const FrameSize size{40, 30};
  for (const Truth& truth : make_truths(size)) {
    std::vector<float> z(size_t{40} * 30);
    line_integral(truth.gradients.data(), 40, 30, z.data());
    const SurfaceErrors errors =
        errors_of(truth, size, [&](uint32_t x, uint32_t y) { return z[y * 40 + x]; });
    if (truth.name == "tilted") {
      EXPECT_LT(errors.relative_rms, 1e-6);
    }
    if (truth.name == "smooth") {
      EXPECT_LT(errors.relative_rms, 0.1);
    }
    const SurfaceErrors none =
        errors_of(truth, size, [&](uint32_t x, uint32_t y) { return truth.height[y * 40 + x] + 7; });
    EXPECT_LT(none.relative_rms, 1e-12) << truth.name;
  }
}

TEST(Profile, JsonComesBackAsItWas) {
  const Profile profile = made_up("a device", 2);
  const fs::path file = fs::temp_directory_path() / ("palpate-profile-" + std::to_string(getpid()) + ".json");
  spill(file, file_text(profile));
  const Profile back = load_profile(file);
  fs::remove(file);
  EXPECT_EQ(file_text(back), file_text(profile));
  EXPECT_EQ(back.machine.device, "a device");
  EXPECT_EQ(back.sizes.at(1).stages.at(0).time.q75_ms, profile.sizes[1].stages[0].time.q75_ms);
}

TEST(Profile, CompareGivesRatiosWithTheirSpread) {
  const MachineComparison same = compare_profiles({made_up("A", 2), made_up("A", 2)});
  ASSERT_TRUE(same.frames.at(1).ratio);
  EXPECT_NEAR(*same.frames[1].ratio, 1, 1e-12);
  EXPECT_NEAR(same.frames[1].spread, 1, 1e-12);
  EXPECT_NE(same.names.at(0), same.names.at(1)) << "two machines must be told apart";

  Profile slow = made_up("B", 6);
  slow.machine.palpate = "0.2.0";
  slow.complete = false;
  slow.sizes.push_back(size_figure(4096, 4096, 100));
  const MachineComparison compared = compare_profiles({made_up("A", 2), slow});
  EXPECT_NEAR(*compared.frames.at(1).ratio, 3, 1e-12);
  const auto frame = std::find_if(compared.figures.begin(), compared.figures.end(),
                                  [](const ComparedFigure& f) { return f.what == "frame"; });
  ASSERT_NE(frame, compared.figures.end());
  const ComparedValue& b = frame->values.at(1);
  EXPECT_NEAR(b.ratio, 3, 1e-12);
  EXPECT_NEAR(b.ratio_low, 3 * 0.9 / 1.1, 1e-12);
  EXPECT_NEAR(b.ratio_high, 3 * 1.1 / 0.9, 1e-12);
  const std::string text = describe(compared);
  for (const char* said :
       {"version of palpate differs: A 0.1.0, B 0.2.0", "B was ended before it was complete",
        "only in B, not in A: 4096 x 4096 shading", "3.00 times as long on B: B as on A"})
    EXPECT_TRUE(contains(text, said)) << said << "\n" << text;
}

// Any number of machines on one page, also where one has measured less.
TEST(Profile, CompareTakesManyMachines) {
  Profile sparse = made_up("a card", 1);
  sparse.solvers.clear();
  sparse.sizes.resize(1);
  const MachineComparison compared =
      compare_profiles({made_up("first", 2), made_up("second", 4), sparse, made_up("fourth", 8)});
  ASSERT_EQ(compared.frames.size(), 4u);
  EXPECT_NEAR(*compared.frames[1].ratio, 2, 1e-12);
  EXPECT_NEAR(*compared.frames[2].ratio, 0.5, 1e-12);
  EXPECT_NEAR(*compared.frames[3].ratio, 4, 1e-12);
  for (const ComparedFigure& f : compared.figures) {
    ASSERT_EQ(f.values.size(), 4u) << f.what;
    EXPECT_FALSE(f.what.starts_with("error of") && f.values[2].value) << f.what;
  }
  EXPECT_TRUE(contains(to_csv(compared), "C: a card,"));
  // Earlier versions wrote figures of cards that were not there.
  std::string written = file_text(made_up("a card", 1));
  const std::string machine = "\"machine\": {";
  ASSERT_TRUE(contains(written, machine));
  written.insert(written.find(machine) + machine.size(), "\"kind\": \"modelled\",");
  EXPECT_THROW(parse_profile(written, "card.json"), Error);
  EXPECT_EQ(letter_of(25), "Z");
  EXPECT_EQ(letter_of(26), "AA");
  const palpate::Table table(to_csv(compared));
  table.expect_whole();
}

TEST(Profile, CompareSaysWhereNothingIsInCommon) {
  Profile other = made_up("B", 2);
  other.sizes = {size_figure(100, 100, 1)};
  const MachineComparison compared = compare_profiles({made_up("A", 2), other});
  EXPECT_FALSE(compared.frames.at(1).ratio);
  EXPECT_TRUE(contains(describe(compared), "have no size and reading in common"));
}

TEST(Profile, CsvNamesUnitsAndHoldsWholeRows) {
  for (const auto& [name, text] : csv_files(made_up("x, \"y\"", 2))) {
    const palpate::Table table(text);
    table.expect_whole();
    EXPECT_FALSE(table.rows.empty()) << name;
    for (const std::string& column : table.columns) {
      const bool quantity = contains(column, "time") || contains(column, "memory") ||
                            contains(column, "width") || contains(column, "read_") ||
                            contains(column, "rate") || contains(column, "median");
      if (!quantity) continue;
      EXPECT_TRUE(column.ends_with("_ms") || column.ends_with("_bytes") || column.ends_with("_px") ||
                  column.ends_with("_GB_per_s") || column.ends_with("_Hz"))
          << name << ": " << column;
    }
  }
}

TEST(Profile, FiguresAndBytesAreReadable) {
  EXPECT_EQ(figure(0), "0");
  EXPECT_EQ(figure(12.345), "12.3");
  EXPECT_EQ(figure(0.012345), "0.0123");
  EXPECT_EQ(figure(1234.5), "1234");
  EXPECT_EQ(figure(1.2e-8), "1.2e-08");
  EXPECT_EQ(bytes_text(999), "999 B");
  EXPECT_EQ(bytes_text(1500000), "1.50 MB");
  EXPECT_EQ(csv_cell("a,\"b\""), "\"a,\"\"b\"\"\"");
}

TEST(Profile, ReportIsSelfContainedAndEscapesNames) {
  const Profile profile = made_up("<script>alert('x')</script> & \"co\"", 2);
  std::vector<DrawnPlot> drawn;
  for (const NamedPlot& plot : plots_of(profile)) {
    const Picture picture = run_gnuplot(plot_script(plot.plot, PlotKind::Svg, plot.name));
    if (picture.missing) break;
    EXPECT_EQ(picture.error, "") << plot.name;
    EXPECT_TRUE(contains(picture.bytes, "</svg>")) << plot.name;
    drawn.push_back({plot, picture.bytes});
  }
  const std::string html = html_report(profile, drawn);
  expect_self_contained(html);
  EXPECT_TRUE(contains(html, "&lt;script&gt;alert(&#39;x&#39;)&lt;/script&gt; &amp; &quot;co&quot;"));
  EXPECT_TRUE(contains(html, "8192 x 8192, shading"));
  EXPECT_EQ(contains(html, "<svg"), !drawn.empty());

  const MachineComparison compared = compare_profiles({profile, made_up("it's $HOME `B`", 4)});
  for (const NamedPlot& plot : comparison_plots(compared.profiles, compared.names)) {
    const Picture picture = run_gnuplot(plot_script(plot.plot, PlotKind::Png));
    if (picture.missing) break;
    EXPECT_EQ(picture.error, "") << plot.name;
    EXPECT_TRUE(contains(picture.bytes.substr(0, 8), "PNG"));
  }
  expect_self_contained(html_report(compared, {}));
}

TEST(Profile, TwoSizesAreATableAndNoCurve) {
  Profile profile = made_up("a machine", 2);
  const auto curves = [&] {
    const std::vector<NamedPlot> plots = plots_of(profile);
    return std::ranges::count_if(plots, [](const NamedPlot& plot) {
      return plot.name.starts_with("stages-") || plot.name.starts_with("bandwidth-") ||
             plot.name == "throughput";
    });
  };
  profile.sizes = {size_figure(320, 240, 2), size_figure(640, 480, 6), size_figure(1280, 960, 20)};
  EXPECT_EQ(curves(), 3);
  EXPECT_FALSE(contains(html_report(profile, {}), "takes three sizes"));
  profile.sizes.pop_back();
  EXPECT_EQ(curves(), 0);
  const std::string html = html_report(profile, {});
  EXPECT_TRUE(contains(html, "takes three sizes"));
  EXPECT_TRUE(contains(html, "640 x 480")) << "in the tables";
}

TEST(Profile, GnuplotFailuresAreWords) {
  const Picture bad = run_gnuplot("set terminal svg\nplot nonsense(\n");
  EXPECT_TRUE(bad.bytes.empty());
  EXPECT_FALSE(bad.error.empty());
  EXPECT_EQ(bad.error.find('\n'), std::string::npos);
  EXPECT_EQ(gnuplot_quoted("it's\nB"), "'it''s B'");
}

TEST(Profile, WhatWasNotTriedIsNoLimit) {
  // 120 frames/s at 640 x 480 and 30 at 1280 x 960, which is the largest.
  const std::string open = headline(made_up("fast", 10));
  EXPECT_TRUE(contains(open, "shading at 1280 x 960 (larger frames were not tried)")) << open;
  const std::string limit = headline(made_up("slow", 20));
  EXPECT_TRUE(contains(limit, "shading up to 640 x 480")) << limit;
  EXPECT_FALSE(contains(limit, "not tried")) << limit;
  Profile skipped = made_up("slow", 20);
  skipped.sizes.pop_back();
  skipped.skipped = {{"1280 x 960, shading", "needs about 9 s, 1 s of the budget are left"}};
  EXPECT_TRUE(contains(headline(skipped), "shading at 640 x 480 (larger")) << headline(skipped);
  EXPECT_TRUE(contains(headline(made_up("slowest", 100)), "shading at no size that was measured"));
}

TEST(Profile, SmallRunOnARealDevice) {
  gpu::ContextOptions device;
  device.validation = true;
  ProfileRequest request;
  request.sizes = {{64, 48}, {160, 120}};
  request.quick = true;
  request.budget_s = 4;
  request.drawer = viz::timed_drawer;
  Watch watch;
  uint64_t contexts = 0;
  watch.leave = [&](const gpu::Context& context) {
    ++contexts;
    for (const std::string& message : context.validation_messages()) ADD_FAILURE() << message;
  };
  int kept = 0;
  const Profile profile = run_profile(device, request, watch, [&](const Profile&) { ++kept; });
  EXPECT_TRUE(profile.complete);
  EXPECT_EQ(kept, 7);
  EXPECT_GE(contexts, 6u);
  EXPECT_GT(profile.ceiling.GB_per_s, 0);
  for (const CeilingPoint& p : profile.ceiling.points) {
    EXPECT_GT(p.copy_GB_per_s, 0);
    EXPECT_GT(p.stream_GB_per_s, 0);
  }
  std::map<std::string, int> readings;
  for (const SizeFigure& size : profile.sizes) {
    ++readings[size.reading];
    EXPECT_GT(size.latency.min_ms, 0);
    EXPECT_LE(size.latency.min_ms, size.latency.median_ms);
    EXPECT_LE(size.latency.p99_ms, size.latency.max_ms);
    EXPECT_GT(size.cpu_ms, 0);
    EXPECT_GT(size.frames_per_s, 0);
    EXPECT_GT(size.memory_bytes, uint64_t{size.width_px} * size.height_px);
    EXPECT_GE(size.stages.size(), 3u);
    for (const StageFigure& stage : size.stages) {
      EXPECT_GT(stage.time.median_ms, 0) << stage.stage;
      EXPECT_GT(stage.read_bytes, 0u) << stage.stage;
      EXPECT_GT(stage.written_bytes, 0u) << stage.stage;
      EXPECT_NEAR(
          stage.GB_per_s * stage.time.median_ms * 1e6 / double(stage.read_bytes + stage.written_bytes), 1,
          1e-9)
          << stage.stage;
    }
  }
  // A machine that is busy leaves sizes out and says so; of other parts as well.
  const auto sizes_skipped =
      std::count_if(profile.skipped.begin(), profile.skipped.end(),
                    [](const Skipped& s) { return s.what[0] >= '0' && s.what[0] <= '9'; });
  EXPECT_EQ(profile.sizes.size() + static_cast<size_t>(sizes_skipped), 6u);
  EXPECT_EQ(readings.size(), 3u);
  // Known accuracy of the solvers, on the smooth truth at 160 x 120.
  std::map<std::string, double> error;
  for (const SolverFigure& s : profile.solvers)
    if (s.truth == "smooth") error[s.solver] = s.relative_rms_error;
  EXPECT_LT(error.at("best, device"), 1e-4);
  EXPECT_LT(error.at("best, host"), 1e-4);
  EXPECT_LT(error.at("live"), 3e-2);
  for (const SolverFigure& f : profile.solvers)
    EXPECT_TRUE(std::isfinite(f.peak_to_valley_error)) << f.solver;
  for (const OutputFigure& o : profile.outputs) {
    EXPECT_GT(o.time.median_ms, 0);
    EXPECT_GT(o.cpu_ratio, 0);
    if (o.outputs == "force only" && o.reading == profile.outputs.front().reading) {
      EXPECT_LT(o.memory_bytes, profile.outputs.front().memory_bytes);
    }
  }
  EXPECT_EQ(profile.live.size(), 2u);
  for (const LiveFigure& l : profile.live) {
    EXPECT_GT(l.to_measured.min_ms, 0);
    EXPECT_GT(l.to_picture.median_ms, l.to_measured.min_ms);
    EXPECT_LE(l.to_measured.samples + l.dropped_before_engine, l.frames);
    EXPECT_LE(l.to_picture.samples, l.to_measured.samples);
  }
}

TEST(Profile, HostClockTimesTheSameStages) {
  gpu::ContextOptions options;
  options.validation = true;
  options.host_timers = true;
  Profile profile;
  profile.ceiling.clock = "host";
  profile.ceiling.GB_per_s = 10;
  Watch watch;
  watch.leave = [&](const gpu::Context& context) {
    for (const std::string& message : context.validation_messages()) ADD_FAILURE() << message;
  };
  measure_sizes(options, {{160, 120}}, {SurfaceReading::Photometric}, 0.2, watch, profile);
  ASSERT_EQ(profile.sizes.size(), 1u);
  std::vector<std::string> stages;
  for (const StageFigure& s : profile.sizes[0].stages) {
    stages.push_back(s.stage);
    EXPECT_GT(s.time.min_ms, 0);
  }
  EXPECT_EQ(stages, (std::vector<std::string>{"contact", "slope", "surface", "rest level"}));
}

// By hand: 'finish' of 4 ms holds 'rest correction' of 1 and 'device wait' of 2, which holds 'submit' of 0.5.
TEST(Profile, ThreadsAreTheirSpansWithoutThoseWithinThem) {
  const std::string trace = R"([
{"name":"thread_name","ph":"M","pid":1,"tid":1,"args":{"name":"engine"}},
{"name":"submit","ph":"X","ts":2200,"dur":500,"pid":1,"tid":1},
{"name":"device wait","ph":"X","ts":2000,"dur":2000,"pid":1,"tid":1},
{"name":"rest correction","ph":"X","ts":4500,"dur":1000,"pid":1,"tid":1},
{"name":"finish","ph":"X","ts":2000,"dur":4000,"pid":1,"tid":1},
{"name":"thread_name","ph":"M","pid":1,"tid":2,"args":{"name":"capture"}},
{"name":"capture","ph":"X","ts":1000,"dur":300,"pid":1,"tid":2},
{"name":"finish","ph":"X","ts":7000,"dur":3000,"pid":1,"tid":1},
{"name":"capture","ph":"X","ts":10500,"dur":500,"pid":1,"tid":2}
])";
  const std::vector<ThreadPart> parts = thread_parts(trace);
  std::vector<std::string> found;
  found.reserve(parts.size());
  for (const ThreadPart& part : parts) found.push_back(part.thread + ", " + part.step + ", " + part.part);
  EXPECT_EQ(found, (std::vector<std::string>{"capture, capture, capture", "engine, submit, submit",
                                             "engine, device, device wait", "engine, finish, finish",
                                             "engine, finish, rest correction"}));
  EXPECT_NEAR(parts[0].time.median_ms, 0.4, 1e-9);
  EXPECT_NEAR(parts[0].ms_per_turn, 0.4, 1e-9);
  EXPECT_NEAR(parts[0].busy, 0.08, 1e-9);  // of the 10 ms from the first span's begin to the last one's end
  EXPECT_NEAR(parts[1].time.median_ms, 0.5, 1e-9);
  EXPECT_NEAR(parts[1].ms_per_turn, 0.25, 1e-9);  // one of two frames
  EXPECT_NEAR(parts[2].time.median_ms, 1.5, 1e-9);
  EXPECT_EQ(parts[3].time.samples, 2u);
  EXPECT_NEAR(parts[3].time.min_ms, 1, 1e-9);
  EXPECT_NEAR(parts[3].time.max_ms, 3, 1e-9);
  EXPECT_NEAR(parts[3].ms_per_turn, 2, 1e-9);
  EXPECT_NEAR(parts[4].busy, 0.1, 1e-9);
  EXPECT_THROW(thread_parts("no trace"), json::Error);
}

TEST(Profile, RatesOfFastCamerasCountEveryFrame) {
  Profile profile;
  // On a busy machine a short time is too short for a few frames.
  for (double seconds = 4; seconds < 400; seconds *= 4) {
    profile = {};
    measure_rates({}, seconds, {}, profile);
    if (profile.rates.size() == 6 &&
        std::ranges::all_of(profile.rates, [](const RateFigure& r) { return r.frames_per_s > 0; }))
      break;
  }
  ASSERT_EQ(profile.rates.size(), 6u);
  for (const RateFigure& figure : profile.rates) {
    EXPECT_GE(figure.rate_Hz, 120) << figure.scene;
    EXPECT_GT(figure.frames_per_s, 0) << figure.scene;
    EXPECT_GT(figure.to_measured.median_ms, 0) << figure.scene;
    EXPECT_EQ(figure.to_picture.samples, 0u) << figure.scene;
    // All but those of the start, and what was under way at the end.
    EXPECT_NEAR(static_cast<double>(figure.frames),
                static_cast<double>(figure.dropped_before_engine + figure.to_measured.samples), 8)
        << figure.scene;
  }
  Profile none;
  measure_rates({}, 0.1, {}, none);
  EXPECT_TRUE(none.rates.empty());
  ASSERT_EQ(none.skipped.size(), 1u);
  EXPECT_EQ(none.skipped[0].what, "rates of fast cameras");
}

TEST(Profile, FromPhotonToPictureHasEveryThread) {
  Profile profile;
  // On a busy machine a short time is too short for three frames.
  for (double seconds = 6; profile.photon.size() < 3 && seconds < 400; seconds *= 4) {
    profile = {};
    measure_photon({}, viz::timed_drawer, seconds, {}, profile);
  }
  ASSERT_EQ(profile.photon.size(), 3u);
  for (const PhotonFigure& figure : profile.photon) {
    std::set<std::string> threads, steps;
    for (const ThreadPart& part : figure.parts) {
      threads.insert(part.thread);
      steps.insert(part.step);
      EXPECT_GT(part.time.samples, 0u) << part.part;
      EXPECT_GT(part.ms_per_turn, 0) << part.part;
      EXPECT_LE(part.busy, 1) << part.part;
    }
    EXPECT_EQ(threads, (std::set<std::string>{"capture", "drawing", "engine", "record"})) << figure.scene;
    EXPECT_EQ(steps, (std::set<std::string>(std::begin(kPhotonSteps), std::end(kPhotonSteps))))
        << figure.scene;
    EXPECT_GT(figure.frames_per_s, 0) << figure.scene;
    EXPECT_GT(figure.to_picture.median_ms, figure.to_measured.min_ms) << figure.scene;
  }
  Profile none;
  measure_photon({}, viz::timed_drawer, 0.1, {}, none);
  EXPECT_TRUE(none.photon.empty());
  ASSERT_EQ(none.skipped.size(), 1u);
  EXPECT_EQ(none.skipped[0].what, "from photon to picture");
}

TEST(Profile, WhereNothingCanBeRecordedTheRestStands) {
  const char* const before = std::getenv("TMPDIR");
  const std::string kept = before ? before : "";
  ::setenv("TMPDIR", "/proc", 1);
  Profile profile;
  measure_photon({}, viz::timed_drawer, 7, {}, profile);
  before ? ::setenv("TMPDIR", kept.c_str(), 1) : ::unsetenv("TMPDIR");
  EXPECT_TRUE(profile.photon.empty());
  ASSERT_EQ(profile.skipped.size(), 1u);
  EXPECT_TRUE(contains(profile.skipped[0].why, "wanted a folder for a recording")) << profile.skipped[0].why;
}

TEST(Profile, StoppedKeepsWhatIsFinished) {
  ProfileRequest request;
  request.sizes = {{64, 48}, {96, 64}};
  request.budget_s = 1;
  Watch watch;
  int said = 0;
  watch.say = [&](const std::string&) { ++said; };
  watch.stopped = [&] { return said >= 2; };  // after the ceiling and the first size
  const Profile profile = run_profile({}, request, watch, [](const Profile&) {});
  EXPECT_FALSE(profile.complete);
  EXPECT_EQ(profile.sizes.size(), 1u);
  EXPECT_TRUE(profile.solvers.empty());
}

TEST(Profile, SizesThatDoNotFitTheBudgetAreNamed) {
  Profile profile;
  profile.ceiling.clock = "GPU";
  measure_sizes({}, {{64, 48}, {4096, 4096}}, {SurfaceReading::Shading}, 0.05, {}, profile);
  EXPECT_EQ(profile.sizes.size(), 1u);
  ASSERT_EQ(profile.skipped.size(), 1u);
  EXPECT_EQ(profile.skipped[0].what, "4096 x 4096, shading");
  EXPECT_TRUE(contains(profile.skipped[0].why, "of the budget are left")) << profile.skipped[0].why;
}

}  // namespace
}  // namespace palpate::perf

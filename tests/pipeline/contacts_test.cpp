// Several contacts through the whole engine: against the synthetic sensor's truth, with others next to
// them.
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>

#include "palpate/pipeline.h"
#include "tests/scenes/synthetic_run.h"
#include "tests/support/gpu_fixture.h"

namespace palpate {
namespace {

constexpr Outputs kContacts = Output::Force | Output::Contacts;

/// A synthetic scene and a pipeline for it.
struct Rig {
  Rig(gpu::Context& context, const std::string& text, const PipelineOptions& options)
      : run(text), pipeline(run.pipeline(context, options)) {}
  Touch at(uint64_t frame) { return pipeline.process(run.frame(frame)).touch; }

  SyntheticRun run;
  Pipeline pipeline;
};

PipelineOptions options_of(Outputs outputs) {
  PipelineOptions options;
  options.outputs = outputs;
  options.solver = SurfaceSolver::Live;
  options.slots = 1;
  return options;
}

/// To the last bit, but for ids and what follows from earlier frames.
void expect_same_shape(const ContactTouch& a, const ContactTouch& b, const std::string& what) {
  EXPECT_EQ(a.gray_sum, b.gray_sum) << what;
  EXPECT_EQ(a.centroid_x_px, b.centroid_x_px) << what;
  EXPECT_EQ(a.centroid_y_px, b.centroid_y_px) << what;
  EXPECT_EQ(a.area_px, b.area_px) << what;
  EXPECT_EQ(a.ellipse.major_mm, b.ellipse.major_mm) << what;
  EXPECT_EQ(a.ellipse.angle_rad, b.ellipse.angle_rad) << what;
  EXPECT_EQ(a.peak_gray, b.peak_gray) << what;
  EXPECT_EQ(a.saturated_px, b.saturated_px) << what;
  EXPECT_EQ(a.at_border, b.at_border) << what;
  EXPECT_EQ(a.box, b.box) << what;
}

class Contacts : public GpuTest {};

// Five fingers come, press, move and go: each is found, keeps one id from onset to end, and its force and
// place are the truth's.
TEST_F(Contacts, FingersAreFoundAndFollowed) {
  Rig rig(context(), "fingers?size=480x360&rate=8", options_of(kContacts));
  std::map<uint32_t, std::array<double, 2>> last;  // where each id was
  std::set<uint32_t> present;
  std::vector<double> force_error_N, place_error_px;
  size_t most = 0;
  for (uint64_t k = 0; k < *rig.run.source.frame_count(); ++k) {
    const Truth truth = *rig.run.source.truth(k);
    const Touch touch = rig.at(k);
    ASSERT_TRUE(touch.regions.has_value());
    EXPECT_FALSE(touch.regions->overflow);
    const std::string frame = "frame " + std::to_string(k);
    // A contact of a few millinewtons is too small and too dim to be seen.
    constexpr double kSeen_N = 0.03;
    const auto seen =
        std::ranges::count_if(truth.contacts, [](const TrueContact& c) { return c.force_N > kSeen_N; });
    EXPECT_GE(touch.contacts.size(), static_cast<size_t>(seen)) << frame;
    EXPECT_LE(touch.contacts.size(), truth.contacts.size()) << frame;
    most = std::max(most, touch.contacts.size());
    present.clear();
    double sum_N = 0;
    for (const ContactTouch& contact : touch.contacts) {
      const auto distance = [&](const TrueContact& c) {
        return std::hypot(c.center_x_px - contact.centroid_x_px, c.center_y_px - contact.centroid_y_px);
      };
      const TrueContact& nearest = *std::ranges::min_element(truth.contacts, {}, distance);
      sum_N += contact.force_N.value;
      // An id goes where its finger goes, and nobody else's.
      EXPECT_TRUE(present.insert(contact.id).second) << frame;
      if (last.contains(contact.id)) {
        EXPECT_LT(std::hypot(contact.centroid_x_px - last[contact.id][0],
                             contact.centroid_y_px - last[contact.id][1]),
                  8)
            << frame << ", id " << contact.id;
      }
      last[contact.id] = {contact.centroid_x_px, contact.centroid_y_px};
      if (nearest.force_N > 0.1) {
        place_error_px.push_back(distance(nearest));
        force_error_N.push_back(std::abs(contact.force_N.value - nearest.force_N));
        EXPECT_LT(distance(nearest), 0.3) << frame << ", id " << contact.id;
        EXPECT_NEAR(contact.force_N.value, nearest.force_N, 0.01 * nearest.force_N + 0.01)
            << frame << ", id " << contact.id;
      }
      EXPECT_NEAR(contact.centroid_x_px, contact.box.x + contact.box.width / 2.0, 3) << frame;
      EXPECT_EQ(contact.slip == Slip::NotCalibrated, false);
    }
    if (touch.contacts.size() > 1) {
      EXPECT_NEAR(touch.force_N.value, sum_N, 1e-12) << frame;
    }
  }
  EXPECT_EQ(most, 5u);
  // One of the five comes twice.
  EXPECT_EQ(last.size(), 6u);
  std::ranges::sort(force_error_N);
  std::ranges::sort(place_error_px);
  ASSERT_GT(force_error_N.size(), 80u);
  std::printf("median error of a contact's force %.4f N, of its centre %.4f px\n",
              force_error_N[force_error_N.size() / 2], place_error_px[place_error_px.size() / 2]);
  EXPECT_LT(force_error_N[force_error_N.size() / 2], 0.008);
  EXPECT_LT(place_error_px[place_error_px.size() / 2], 0.05);
}

// With one contact alone nothing else changes: the frame's own numbers are what they are without.
TEST_F(Contacts, OneContactIsTheWholeTouch) {
  Rig apart(context(), "palpation?size=320x240&rate=5&noise=off", options_of(kContacts));
  Rig whole(context(), "palpation?size=320x240&rate=5&noise=off", options_of(Output::Force));
  int touched = 0;
  for (uint64_t k = 0; k < 60; ++k) {
    const Touch a = apart.at(k), b = whole.at(k);
    EXPECT_FALSE(b.regions.has_value());
    EXPECT_EQ(a.gray_sum, b.gray_sum);
    EXPECT_EQ(a.force_N.value, b.force_N.value);
    EXPECT_EQ(a.force_N.validity, b.force_N.validity);
    if (a.contacts.size() != 1) continue;
    ++touched;
    const ContactTouch& c = a.contacts.front();
    if (a.regions->small == 0) {
      EXPECT_EQ(c.gray_sum, a.gray_sum) << k;
      EXPECT_EQ(c.area_px, a.area_px) << k;
      EXPECT_EQ(c.centroid_x_px, a.centroid_x_px) << k;
      EXPECT_EQ(c.centroid_y_px, a.centroid_y_px) << k;
      EXPECT_EQ(c.ellipse.major_mm, a.ellipse.major_mm) << k;
      EXPECT_EQ(c.peak_gray, a.peak_gray) << k;
      EXPECT_EQ(c.force_N.value, a.force_N.value) << k;
    }
  }
  EXPECT_GT(touched, 20);
}

// A contact that the frame cuts off says so in force and shear; and a shear whose contact began there says so
// for as long as it lasts.
TEST_F(Contacts, BorderIsAStateOfForceAndShear) {
  const SyntheticOptions options = parse_synthetic("synthetic:palpation?size=320x240");
  const Sensor sensor = synthetic_sensor(options);
  const FrameFormat format{320, 240, 1, 8};
  Pipeline pipeline(context(), sensor, format, options_of(kContacts));
  Frame rest;
  rest.reshape(format);
  pipeline.set_background(rest);
  const auto disc = [&](std::initializer_list<std::array<int, 2>> centers) {
    Frame frame;
    frame.reshape(format);
    for (const auto& [cx, cy] : centers)
      for (int y = std::max(cy - 20, 0); y < std::min(cy + 20, 240); ++y)
        for (int x = std::max(cx - 20, 0); x < std::min(cx + 20, 320); ++x)
          if (std::hypot(x - cx, y - cy) < 20)
            frame.set(0, static_cast<uint32_t>(x), static_cast<uint32_t>(y), 60);
    return frame;
  };
  Touch touch = pipeline.process(disc({{160, 120}})).touch;
  EXPECT_FALSE(touch.at_border);
  EXPECT_EQ(touch.force_N.validity, Validity::Valid);
  EXPECT_EQ(touch.shear_x_N.validity, Validity::Valid);
  // The second reaches the border: it alone, and the sum.
  touch = pipeline.process(disc({{160, 120}, {10, 120}})).touch;
  ASSERT_EQ(touch.contacts.size(), 2u);
  EXPECT_TRUE(touch.at_border);
  EXPECT_FALSE(touch.contacts[0].at_border);
  EXPECT_EQ(touch.contacts[0].force_N.validity, Validity::Valid);
  EXPECT_EQ(touch.contacts[1].force_N.validity, Validity::AtBorder);
  EXPECT_EQ(touch.force_N.validity, Validity::AtBorder);
  EXPECT_EQ(touch.shear_x_N.validity, Validity::AtBorder);
  // It moves inside: its force is whole, its shear counts from a place that was wrong.
  touch = pipeline.process(disc({{160, 120}, {26, 120}})).touch;
  ASSERT_EQ(touch.contacts.size(), 2u);
  EXPECT_FALSE(touch.at_border);
  EXPECT_EQ(touch.contacts[1].id, 2u);
  EXPECT_EQ(touch.force_N.validity, Validity::Valid);
}

// A gap: all contacts are new, and say that their onset was not seen.
TEST_F(Contacts, AfterAGapTheyStartAnew) {
  const SyntheticSensor source(parse_synthetic("synthetic:fingers?size=320x240&rate=10"));
  Rig rig(context(), "fingers?size=320x240&rate=10", options_of(kContacts));
  Frame frame;
  const Touch before = rig.at(50);
  ASSERT_GE(before.contacts.size(), 4u);
  ASSERT_TRUE(source.render(51, frame));
  frame.after_gap = true;
  const Touch after = rig.pipeline.process(frame).touch;
  ASSERT_EQ(after.contacts.size(), before.contacts.size());
  EXPECT_EQ(after.contacts.front().id, before.contacts.back().id + 1);
  EXPECT_EQ(after.contacts.front().shear_x_N.validity, Validity::OnsetUnseen);
  EXPECT_EQ(after.contacts.front().frames, 1u);
}

// Frames in flight keep their regions apart.
TEST_F(Contacts, SlotsDoNotMixTheirRegions) {
  const std::string scene = "fingers?size=320x240&rate=10";
  Rig alone(context(), scene, options_of(kContacts));
  PipelineOptions options = options_of(kContacts);
  options.slots = 3;
  Rig many(context(), scene, options);
  Frame frame;
  for (uint64_t k = 20; k < 60; k += 3) {
    for (uint64_t i = 0; i < 3; ++i) {
      ASSERT_TRUE(many.run.source.render(k + i, frame));
      ASSERT_TRUE(many.pipeline.submit(frame));
    }
    for (uint64_t i = 0; i < 3; ++i) {
      const std::optional<Result> result = many.pipeline.wait();
      const Touch wanted = alone.at(k + i);
      ASSERT_EQ(result->touch.contacts.size(), wanted.contacts.size());
      for (size_t c = 0; c < wanted.contacts.size(); ++c)
        expect_same_shape(result->touch.contacts[c], wanted.contacts[c], "frame " + std::to_string(k + i));
    }
  }
}

}  // namespace
}  // namespace palpate

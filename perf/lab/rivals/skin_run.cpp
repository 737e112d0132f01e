#include "perf/lab/rivals/skin_run.h"

#include <cmath>

namespace palpate::perf {
namespace {

SyntheticOptions scene(const std::string& size, const std::string& pattern) {
  return parse_synthetic("synthetic:twist?size=" + size + "&skin=" + pattern + "&mode=gel");
}

}  // namespace

SkinRun::SkinRun(gpu::Context& context, const std::string& size, const std::string& pattern)
    : source_(scene(size, pattern)),
      untouched_(*source_.own_background()),
      stage_(context, synthetic_sensor(scene(size, pattern)), source_.format()) {
  stage_.set_background(untouched_);
  for (const SkinTemplate& t : stage_.templates()) points_.push_back(t.centre);
  rival_ =
      std::make_unique<OpenCvSkin>(untouched_, points_, static_cast<int>(2 * stage_.window().reach_px() + 1));
  records_ = gpu::DeviceBuffer(context, "records", stage_.record_bytes(), gpu::Memory::Readback);
  for (uint64_t k = 0; k < kFrames; ++k) {
    source_.render(kFirst + k, frames_.emplace_back());
    images_.emplace_back(context, "frame", source_.format()).write(frames_.back());
    gpu::Commands& one = commands_.emplace_back(context);
    one.begin();
    images_.back().record(one);
    one.barrier();
    stage_.record(one, images_.back(), records_);
    one.host_barrier();
    one.end();
  }
}

size_t SkinRun::place(size_t turn) {
  return turn % (2 * kFrames) < kFrames ? turn % kFrames : kFrames - 1 - turn % kFrames;
}

void SkinRun::follow() {
  gpu::Commands& one = commands_[place(turn_++)];
  one.submit();
  one.wait();
  records_.invalidate();
}

void SkinRun::rival_follow() {
  rival_places_ = &rival_->follow(frames_[place(rival_turn_++)]);
}

std::array<double, 2> SkinRun::errors_px() {
  constexpr size_t kEvery = 31;  // points of a frame
  std::array<double, 2> squares{}, count{};
  for (turn_ = rival_turn_ = 0; turn_ < kFrames;) {
    const uint64_t sequence = kFirst + turn_;
    follow();
    rival_follow();
    const auto motions = records_.as<const Skin::Motion>();
    for (size_t i = sequence % kEvery; i < points_.size(); i += kEvery) {
      const auto truth = source_.skin_shift_px(sequence, double{points_[i][0]}, double{points_[i][1]});
      const auto add = [&](size_t who, double x, double y) {
        squares[who] += (std::pow(x - truth[0], 2) + std::pow(y - truth[1], 2)) / 2;
        ++count[who];
      };
      if (motions[i].correlation > 0) add(0, double{motions[i].shift_x_px}, double{motions[i].shift_y_px});
      const std::array<float, 2>& to = (*rival_places_)[i];
      if (to[0] == to[0])
        add(1, double{to[0]} - double{points_[i][0]}, double{to[1]} - double{points_[i][1]});
    }
  }
  return {std::sqrt(squares[0] / count[0]), std::sqrt(squares[1] / count[1])};
}

}  // namespace palpate::perf

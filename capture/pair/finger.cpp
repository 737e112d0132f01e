#include "capture/pair/finger.h"

#include <utility>

#include "capture/files/output_file.h"
#include "capture/live/patience.h"
#include "capture/open_source.h"
#include "palpate/error.h"

namespace palpate {

OpenFinger::OpenFinger(RunSettings settings, bool again, const RunWatch& watch)
    : found(find_input(settings)) {
  if (again) {
    as_recorded(settings, found.session.value());
    found.outputs = found.session->outputs;
  }
  source = open_source(found.input, found.sensor);
  source->watch(
      [&watch, from = source.get(), patience = Patience(settings.patience_s, found.input)]() mutable {
        return watch.stopped() || patience.over(*from);
      });
  background = load_background(found.input, found.sensor, *source);
  pipeline = pipeline_options(settings, found.outputs, *source);
  if (pipeline.separate)
    throw Error(Failure::Usage, "frames with times, to be paired",
                "'" + settings.input + "': pictures without a rate", "--rate, the rate they were taken at");
  static_cast<LoopSettings&>(live) = settings;
  live.input = found.input;
  live.unpaced = live.measure_all = !source->live() && live.rate_Hz <= 0;
}

PairFinger OpenFinger::pair() const {
  // The source that is open already is the first round's: a camera cannot be opened twice.
  auto open = [this, first = source]() mutable {
    return first ? std::exchange(first, nullptr)
                 : std::shared_ptr<Source>(open_source(found.input, found.sensor));
  };
  return {std::move(open), {found.sensor, background, pipeline}, live};
}

FingerTables::FingerTables(const std::filesystem::path& folder, std::array<OpenFinger, 2>& fingers) {
  for (const Side side : kSides) {
    OpenFinger& finger = fingers[index(side)];
    std::optional<Measurements>& rows = rows_[index(side)];
    make_output_folder(finger_folder(folder, side));
    rows.emplace(finger_folder(folder, side) / "measurements.csv",
                 MeasuredColumns::of(finger.found.sensor, finger.found.outputs));
    finger.live.on_result = [&rows](const Touch& touch) { rows->add(touch, nullptr); };
  }
}

void FingerTables::close() {
  for (std::optional<Measurements>& rows : rows_) rows->close();
}

PairInfo pair_info(const std::array<OpenFinger, 2>& fingers) {
  constexpr double kUsual_Hz = 30;
  PairInfo info;
  double slowest_Hz = 0;
  for (size_t i = 0; i < 2; ++i) {
    info.inputs[i] = fingers[i].found.input;
    if (const double Hz = fingers[i].rate_Hz(); Hz > 0 && (slowest_Hz == 0 || Hz < slowest_Hz))
      slowest_Hz = Hz;
  }
  info.period_s = 1 / (slowest_Hz > 0 ? slowest_Hz : kUsual_Hz);
  return info;
}

}  // namespace palpate

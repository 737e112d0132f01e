// Contact, its regions and moments, and the upload of the frame to the device.
#include "perf/lab/bench/bench.h"

#include <sys/mman.h>
#include <algorithm>
#include <cstring>
#include <memory>
#include <new>
#include <vector>

#include "engine/base/mapped_pages.h"
#include "engine/gpu/commands.h"
#include "engine/stages/frame/contact.h"
#include "perf/rivals/rivals.h"

namespace palpate::perf {
namespace {

/// The frame as a camera driver would hand it out: in pages mapped for it alone.
Frame lease(const Frame& frame) {
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

}  // namespace

void Bench::contact(const Size& size) {
  Scene scene = scene_for(size, SyntheticMode::Lambert);
  Pipeline pipeline = make_pipeline(scene, Output::Force, SurfaceSolver::Live);
  OpenCvContact rival(scene.background, scene.sensor);
  const Work ours{"palpate", [&] { pipeline.process(scene.next()); }};
  add(compare("contact", size.text(), ours, {"OpenCV 8 bit", [&] { sink_ += rival.run_8bit(scene.next()); }},
              repetitions_, inner(size, 20)));
  add(compare("contact", size.text(), ours, {"OpenCV float", [&] { sink_ += rival.run_float(scene.next()); }},
              repetitions_, inner(size, 20)));
}

void Bench::regions(const Size& size) {
  Scene scene = fingers_for(size, SyntheticMode::Lambert);
  Pipeline apart = make_pipeline(scene, Output::Force | Output::Contacts, SurfaceSolver::Live);
  Pipeline whole = make_pipeline(scene, Output::Force, SurfaceSolver::Live);
  OpenCvContact rival(scene.background, scene.sensor);
  const Work ours{"palpate", [&] { apart.process(scene.next()); }};
  add(compare("contact and regions", size.text(), ours,
              {"OpenCV 8 bit", [&] { sink_ += rival.run_regions(scene.next()); }}, repetitions_,
              inner(size, 20)));
  add(compare("contact and regions", size.text(), ours,
              {"contact alone", [&] { whole.process(scene.next()); }}, repetitions_, inner(size, 20)));
}

void Bench::upload(const Size& size) {
  for (const uint32_t bits : {8u, 16u}) {
    Scene scene = scene_for(size, SyntheticMode::Lambert, bits);
    std::vector<Frame> leased;
    for (const Frame& frame : scene.frames) leased.push_back(lease(frame));
    const auto pipeline = [&](Upload upload) {
      return make_pipeline(scene, Output::Force, SurfaceSolver::Live, upload);
    };
    Pipeline importing = pipeline(Upload::Import), copying = pipeline(Upload::Copy);
    size_t turn = 0;
    const auto next = [&]() -> const Frame& { return leased[turn++ % leased.size()]; };
    add(compare("upload " + std::to_string(bits) + " bit", size.text(),
                {"read in place", [&] { importing.process(next()); }},
                {"copy", [&] { copying.process(next()); }}, repetitions_, inner(size, 40)));
  }
}

void Bench::moments(const Size& size) {
  Scene scene = scene_for(size, SyntheticMode::Lambert);
  for (Frame& frame : scene.frames)
    for (size_t i = 0; i < frame.bytes.size(); ++i)
      frame.bytes[i] -= std::min(frame.bytes[i], scene.background.bytes[i]);
  scene.sensor.reading = SurfaceReading::None;
  scene.sensor.filter = Filter::None;
  scene.sensor.background = {BackgroundKind::None, "", 1};
  std::fill(scene.background.bytes.begin(), scene.background.bytes.end(), uint8_t{0});
  const FrameFormat& format = scene.background.format;
  const Contact contact(context_, scene.sensor, format, false, load_tuning(context_).tuning);
  PaddedImage image(context_, "frame", format);
  image.write(scene.frames.front());
  const gpu::DeviceBuffer records(context_, "records", contact.record_bytes(), gpu::Memory::Readback);
  gpu::run_once(context_, [&](gpu::Commands& upload) { image.record(upload); });
  gpu::Commands commands(context_);
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
  Pipeline pipeline = make_pipeline(scene, Output::Force, SurfaceSolver::Live);
  add(compare("moments of a frame", size.text(), {"palpate", [&] { pipeline.process(scene.frames.front()); }},
              rival, repetitions_, inner(size, 40)));
}

}  // namespace palpate::perf

#include "viz/python/device.h"

#include <unistd.h>

#include <atomic>
#include <map>
#include <mutex>

#include "engine/gpu/tuning.h"
#include "viz/python/errors.h"

namespace palpate::python {
namespace {

struct Devices {
  std::mutex mutex;
  std::map<std::string, std::shared_ptr<gpu::Context>> open;
  std::atomic<pid_t> owner = 0;  ///< the process that opened one; 0: none has
};

/// Never destroyed: a fork leaves its copy alone.
Devices& devices() {
  static auto* const one = new Devices;
  return *one;
}

}  // namespace

bool forked() {
  const pid_t owner = devices().owner;
  return owner != 0 && owner != getpid();
}

std::shared_ptr<gpu::Context> shared_device(const std::string& which) {
  if (forked())
    throw Refusal{"DeviceError", "a Vulkan device in process " + std::to_string(getpid()),
                  "one that process " + std::to_string(devices().owner) + " had opened before it forked",
                  "opening in the child alone, or multiprocessing.set_start_method('spawn')"};
  Devices& all = devices();
  const std::lock_guard lock(all.mutex);
  std::shared_ptr<gpu::Context>& device = all.open[which];
  if (!device) {
    gpu::ContextOptions options;
    options.device = which;
    device = std::make_shared<gpu::Context>(options);
    load_tuning(*device);
    all.owner = getpid();
  }
  return device;
}

void forget_device(const gpu::Context& lost) {
  Devices& all = devices();
  const std::lock_guard lock(all.mutex);
  std::erase_if(all.open, [&](const auto& named) { return named.second.get() == &lost; });
}

void close_devices() {
  if (forked()) return;
  const std::lock_guard lock(devices().mutex);
  devices().open.clear();
}

}  // namespace palpate::python

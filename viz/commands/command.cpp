#include "viz/commands/command.h"

#include <spdlog/spdlog.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <csignal>
#include <cstdio>
#include <utility>

#include "capture/clock.h"
#include "engine/gpu/context.h"
#include "engine/gpu/tuning.h"
#include "viz/commands/options.h"

namespace palpate {
namespace {

constexpr const char* kExitCodes =
    "Exit codes: 0 done, 1 internal error, 2 usage, 3 input, 4 sensor file, 5 device,\n"
    "            6 display, 7 output, 130 ended by Ctrl-C (what was written is kept).";

volatile std::sig_atomic_t interrupt_flag = 0;

void on_signal(int) {
  interrupt_flag = 1;
}

/// What help calls an option's value; the rest (types, ranges, lists of values) is in each option's own
/// words.
constexpr std::pair<const char*, const char*> kValueNames[] = {
    {"--sensor", "FILE"},
    {"--background", "FILE"},
    {"--out", "DIR"},
    {"--device", "INDEX|NAME"},
    {"--seed", "N"},
    {"--frames", "N"},
    {"--repeat", "N"},
    {"--bits", "N"},
    {"--seconds", "S"},
    {"--rate", "HZ"},
    {"--force", "NEWTON"},
    {"--radius", "MM"},
    {"--size", "WxH"},
    {"--sizes", "WxH,..."},
    {"--repetitions", "N"},
    {"--mode", "NAME"},
    {"--response", "NAME"},
    {"--solver", "NAME"},
    {"--vsync", "NAME"},
    {"--outputs", "LIST"},
    {"--depth", "FORMAT"},
    {"--confidence", "FORMAT"},
    {"--picture-every", "N"},
    {"--depth-range", "MM"},
    {"--exaggeration", "FACTOR"},
    {"--view", "AZIMUTH,ELEVATION"},
    {"--speed", "FACTOR"},
    {"--from", "S"},
    {"--camera", "NODE"},
    {"--format", "NAME"},
    {"--fps", "HZ"},
    {"--exposure", "TIME|auto"},
    {"--gain", "N|auto"},
    {"--white-balance", "K|auto"},
    {"--control", "NAME=VALUE"},
    {"--camera-buffers", "N"},
    {"--camera-timeout", "TIME"},
    {"--weights", "FILE"},
    {"--images", "LIST"},
    {"--every", "N"},
    {"--colours", "QUANTITY"},
    {"--skin-strain", "COMPONENT"},
    {"--colour-map", "NAME"},
    {"--colour-range", "MOST"},
    {"--section", "X0,Y0,X1,Y1"},
    {"--gauge", "FILE"},
    {"--align", "auto|none|S"},
    {"--signal", "NAME"},
    {"--model", "NAME"},
    {"--check", "RECORDING"},
    {"--check-gauge", "FILE"},
    {"--plots", "DIR"},
    {"--friction", "MU"},
    {"--balls", "FILE"},
    {"--ball-mm", "MM"},
    {"--ring-mm", "MM"},
    {"--spacing-mm", "MM"},
    {"--travel-mm", "MM,..."},
    {"--grid", "COLUMNSxROWS"},
    {"--pattern", "NAME"},
    {"--indices", "N,..."},
    {"--extinction", "K,..."},
    {"--thickness-mm", "MM,..."},
    {"--angle-deg", "DEG"},
    {"--wavelength-nm", "NM"},
    {"--led-layer", "LAYER"},
    {"--vary", "LAYER:FROM:TO"},
    {"--contact", "N,..."},
    {"--depth-mm", "MM"},
    {"--length-mm", "MM"},
    {"--rays", "N"},
    {"--shape", "NAME"},
    {"--radius-mm", "MM"},
    {"--radius2-mm", "MM"},
    {"--half-angle-deg", "DEG"},
    {"--force-N", "NEWTON"},
    {"--young-kPa", "KPA,..."},
    {"--poisson", "RATIO"},
    {"--series", "NAME"},
    {"--figure", "7|8"},
};

}  // namespace

void add_common(CommandLine& command, Common& common, const std::string& examples) {
  command.add_flag("--json", common.json, "Print one JSON value on stdout and nothing else");
  command.add_flag("--quiet", common.quiet, "No progress, no log except errors");
  command.add_option("--device", common.device,
                     "Vulkan device: index or part of its name (see `palpate devices`)");
  command.add_option("--seed", common.seed, "Seed of everything random")->capture_default_str();
  command.add_flag("--validation", common.validation,
                   "Run under the Vulkan validation layer; any message fails the run");
  command.name_values(kValueNames, std::size(kValueNames));
  command.footer("Examples:\n" + examples + "\n" + kExitCodes + "\n");
}

std::unique_ptr<gpu::Context> open_device(const Common& common,
                                          const std::vector<const char*>* window_extensions) {
  gpu::ContextOptions options;
  options.device = common.device;
  options.validation = common.validation;
  if (window_extensions) {
    options.instance_extensions = *window_extensions;
    options.presentation = true;
  }
  auto context = std::make_unique<gpu::Context>(options);
  spdlog::info("device: {}", context->report().name);
  const std::string ignored = load_tuning(*context).ignored;
  if (!ignored.empty()) spdlog::warn("{}", ignored);
  return context;
}

bool validation_clean(const gpu::Context& context) {
  const std::vector<std::string> messages = context.validation_messages();
  for (const std::string& message : messages) spdlog::error("validation: {}", message);
  return messages.empty();
}

void catch_interrupts() {
  struct sigaction action {};
  action.sa_handler = on_signal;
  action.sa_flags = SA_RESETHAND | SA_RESTART;
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
}

bool interrupted() {
  return interrupt_flag != 0;
}

double now_s() {
  return static_cast<double>(monotonic_ns()) * 1e-9;
}

ProgressBar::ProgressBar(const Common& common, const char* label, uint64_t total)
    : label_(label),
      total_(total),
      shown_(!common.quiet && isatty(STDERR_FILENO)),
      start_ns_(monotonic_ns()) {}

ProgressBar::~ProgressBar() {
  if (shown_ && drawn_ns_ != 0) std::fputs("\r\x1b[K", stderr);
}

void ProgressBar::update(uint64_t done) {
  if (!shown_) return;
  constexpr int64_t kRedraw_ns = 100'000'000;
  const int64_t now = monotonic_ns();
  if (now - drawn_ns_ < kRedraw_ns && done != total_) return;
  drawn_ns_ = now;
  draw(done, now);
}

void ProgressBar::draw(uint64_t done, int64_t now) {
  winsize terminal{};
  const int columns =
      ioctl(STDERR_FILENO, TIOCGWINSZ, &terminal) == 0 && terminal.ws_col > 0 ? terminal.ws_col : 80;
  const double elapsed_s = static_cast<double>(now - start_ns_) * 1e-9;
  const double rate = elapsed_s > 0 ? static_cast<double>(done) / elapsed_s : 0;
  char text[160];
  if (total_ == 0) {
    std::snprintf(text, sizeof text, "%s %llu frames  %.0f/s", label_, static_cast<unsigned long long>(done),
                  rate);
    std::fprintf(stderr, "\r\x1b[K%.*s", columns - 1, text);
    return;
  }
  const double left_s = rate > 0 ? static_cast<double>(total_ > done ? total_ - done : 0) / rate : 0;
  std::snprintf(text, sizeof text, "%llu/%llu  %.0f/s  %.0f s left", static_cast<unsigned long long>(done),
                static_cast<unsigned long long>(total_), rate, left_s);
  constexpr int kBar = 30;
  const int filled = static_cast<int>(static_cast<double>(kBar) *
                                      std::min(1.0, static_cast<double>(done) / static_cast<double>(total_)));
  const std::string bar =
      std::string(static_cast<size_t>(filled), '#') + std::string(static_cast<size_t>(kBar - filled), '.');
  std::fprintf(stderr, "\r\x1b[K%.*s", columns - 1, (std::string(label_) + " [" + bar + "] " + text).c_str());
}

}  // namespace palpate

// palpate simulate: a recording of the built-in sensor on disk, lossless, with its ground truth.
#include <array>
#include <charconv>
#include <cmath>
#include <functional>
#include <memory>

#include "capture/files/images/images.h"
#include "capture/files/measurements.h"
#include "capture/files/npy.h"
#include "capture/files/output_file.h"
#include "capture/synthetic/object.h"
#include "capture/synthetic/synthetic.h"
#include "capture/synthetic/tissue.h"
#include "engine/base/json.h"
#include "palpate/error.h"
#include "palpate/sensor.h"
#include "viz/commands/command.h"
#include "viz/commands/support/options.h"
#include "viz/commands/support/progress.h"

namespace palpate {
namespace {

namespace fs = std::filesystem;

struct Options {
  SyntheticOptions synthetic;
  std::string size = "640x480";
  std::string mode = "waveguide";
  std::string response = "linear";
  std::string skin = "none";
  uint64_t frames = 0;
  double seconds = 0;
  bool noiseless = false;
  bool depth = false;
};

void parse_size(const std::string& text, uint32_t& width, uint32_t& height) {
  const char* end = text.data() + text.size();
  const auto [x, bad_width] = std::from_chars(text.data(), end, width);
  const bool separated = bad_width == std::errc() && x != end && *x == 'x';
  const auto [rest, bad_height] = std::from_chars(separated ? x + 1 : end, end, height);
  if (!separated || bad_height != std::errc() || rest != end || width == 0 || height == 0 ||
      width > kMaxSide_px || height > kMaxSide_px) {
    throw Error(Failure::Usage, "--size WIDTHxHEIGHT, each 1 to " + std::to_string(kMaxSide_px),
                "'" + text + "'", "--size 640x480");
  }
}

void write_png(const fs::path& file, const Frame& frame) {
  write_whole(file, encode_image(frame, ".png"));
}

constexpr const char* kTruthHeader =
    "frame,time_s,true_contact,true_force_N,true_shear_x_N,true_shear_y_N,true_slip,true_center_x_px,true_"
    "center_y_px,"
    "true_radius_px,true_depth_max_mm,true_stick_share,true_torsion_rad,true_volume_mm3,true_contacts";
// Further columns of an object: TrueMotion.
constexpr const char* kMotionHeader =
    ",true_moved_x_mm,true_moved_y_mm,true_moved_z_mm,true_turned_x_rad,true_turned_y_rad,true_turned_z_rad";
// One row a contact and frame.
constexpr const char* kContactsHeader =
    "frame,time_s,true_force_N,true_center_x_px,true_center_y_px,true_radius_px";

std::string truth_row(const Truth& truth) {
  std::string row =
      std::to_string(truth.sequence) + "," + shortest(truth.time_s) + "," + (truth.contact ? "1" : "0");
  for (const double value : {truth.force_N, truth.shear_x_N, truth.shear_y_N}) row += "," + shortest(value);
  row += truth.slipping ? ",1" : ",0";
  if (truth.contact) {
    row += "," + shortest(truth.center_x_px) + "," + shortest(truth.center_y_px);
  } else {
    row += ",,";
  }
  for (const double value :
       {truth.radius_px, truth.indentation_mm, truth.stick_share, truth.torsion_rad, truth.volume_mm3})
    row += "," + shortest(value);
  return row + "," + std::to_string(truth.contacts.size());
}

/// Empty cells where nothing touches.
std::string motion_cells(const Truth& truth) {
  if (!truth.motion) return ",,,,,,";
  std::string cells;
  for (const auto& part : {truth.motion->shift_mm, truth.motion->turn_rad})
    for (const double value : part) cells += "," + shortest(value);
  return cells;
}

void append_contacts(LineFile& file, const Truth& truth) {
  for (const TrueContact& c : truth.contacts)
    file.append(std::to_string(truth.sequence) + "," + shortest(truth.time_s) + "," + shortest(c.force_N) +
                "," + shortest(c.center_x_px) + "," + shortest(c.center_y_px) + "," + shortest(c.radius_px));
}

/// Scene to play: its source and its sensor.
struct Scene {
  std::unique_ptr<Source> source;
  Sensor sensor;
  std::string input;
  std::function<double(uint64_t sequence)> block_force_N;  ///< of a block of tissue; null: of other scenes
  std::string block;                                       ///< options that describe it
  bool moves = false;                                      ///< its truth has an object's motion
};

Scene open_touch(SyntheticOptions synthetic, const Options& options) {
  // The keys of synthetic: inputs say the rest, so that one parser knows them.
  const SyntheticOptions words = parse_synthetic("synthetic:" + synthetic.scene + "?mode=" + options.mode +
                                                 "&response=" + options.response + "&skin=" + options.skin);
  synthetic.mode = words.mode;
  synthetic.response = words.response;
  synthetic.skin = words.skin;
  return {std::make_unique<SyntheticSensor>(synthetic),
          synthetic_sensor(synthetic),
          to_string(synthetic),
          {},
          {}};
}

/// "object", or with keys of its own: "object?shape=bead&path=roll".
Scene open_object(const SyntheticOptions& given, const Options& options) {
  const SyntheticOptions other;
  if (given.bit_depth != 8 || (options.mode != "waveguide" && options.mode != "gel") ||
      options.response != "linear" || given.hysteresis != 0 || given.drift_per_min != 0 ||
      given.indenter_radius_mm != 0 || given.force_N != 0)
    throw Error(Failure::Usage,
                "an object with --size, --rate, --repeat, --skin, --noiseless, --seed, --depth",
                "an option of the other scenes", "'object?shape=bead&path=roll' for what else it has");
  std::string keys = "synthetic:" + given.scene;
  const auto add = [&keys](const std::string& pair) {
    keys += (keys.find('?') == std::string::npos ? "?" : "&") + pair;
  };
  // What is not given is the scene's own.
  if (given.width != other.width || given.height != other.height) add("size=" + options.size);
  if (given.rate_Hz != other.rate_Hz) add("rate=" + shortest(given.rate_Hz));
  if (given.repeat != other.repeat) add("repeat=" + std::to_string(given.repeat));
  if (options.skin != "none") add("skin=" + options.skin);
  if (options.noiseless) add("noise=off");
  if (keys.find("seed=") == std::string::npos) add("seed=" + std::to_string(given.seed));
  const ObjectOptions object = parse_object(keys);
  return {std::make_unique<ObjectSensor>(object), object_sensor(object), to_string(object), {}, {}, true};
}

/// "tissue", or with keys of its own: "tissue?d=6&h=4".
Scene open_tissue(const SyntheticOptions& synthetic, const Options& options) {
  const SyntheticOptions other;
  if (synthetic.bit_depth != other.bit_depth || options.mode != "waveguide" || options.response != "linear" ||
      options.skin != "none" || synthetic.hysteresis != 0 || synthetic.drift_per_min != 0 ||
      synthetic.indenter_radius_mm != 0 || options.depth)
    throw Error(Failure::Usage,
                "a block of tissue with --size, --rate, --repeat, --force, --noiseless, --seed",
                "an option of the other scenes", "'tissue?d=6&h=4&ratio=8' for what else it has");
  TissueOptions tissue = parse_tissue("synthetic:" + synthetic.scene);
  tissue.width = synthetic.width;
  tissue.height = synthetic.height;
  tissue.rate_Hz = synthetic.rate_Hz;
  tissue.repeat = synthetic.repeat;
  tissue.seed = synthetic.seed;
  tissue.noise = synthetic.noise;
  if (synthetic.force_N > 0) tissue.force_N = synthetic.force_N;
  tissue = parse_tissue(to_string(tissue));  // which checks ranges
  auto source = std::make_unique<TissueSensor>(tissue);
  const TissueSensor* block = source.get();
  const std::array<double, 3>& size = tissue.scene.block_mm;
  return {std::move(source), tissue_sensor(tissue), to_string(tissue),
          [block](uint64_t sequence) { return block->block_force_N(sequence); },
          " --block-mm " + shortest(size[0]) + " " + shortest(size[1]) + " " + shortest(size[2]) +
              " --young-Pa " + shortest(tissue.scene.young_Pa) + " --window-at-mm " + shortest(tissue.x_mm) +
              " " + shortest(tissue.y_mm)};
}

Report simulate(const Common& common, const Options& options) {
  SyntheticOptions synthetic = options.synthetic;
  parse_size(options.size, synthetic.width, synthetic.height);
  synthetic.seed = common.seed;
  synthetic.noise = !options.noiseless;
  const bool tissue = is_tissue("synthetic:" + synthetic.scene);
  Scene scene = tissue                                      ? open_tissue(synthetic, options)
                : is_object("synthetic:" + synthetic.scene) ? open_object(synthetic, options)
                                                            : open_touch(synthetic, options);
  Source& source = *scene.source;

  uint64_t limit = options.frames;
  if (options.seconds > 0)
    limit = std::max<uint64_t>(1, static_cast<uint64_t>(std::llround(options.seconds * source.rate_Hz())));
  const std::optional<uint64_t> count = source.frame_count();
  if (limit == 0 && !count)
    throw Error(Failure::Usage, "an end of the recording", "--repeat 0", "--frames or --seconds");
  const uint64_t total = limit == 0 ? *count : count ? std::min(limit, *count) : limit;

  const fs::path& out = common.out;
  make_output_folder(out);
  make_output_folder(out / "frames");
  clear_numbered_files(out / "frames");
  for (const char* name : {"truth.csv", "truth_contacts.csv", "sensor.json", "background.png", "gauge.csv"})
    fs::remove(out / name);
  if (options.depth) {
    make_output_folder(out / "depth");
    clear_numbered_files(out / "depth");
  }
  Sensor& sensor = scene.sensor;
  if (const std::optional<Frame> background = source.own_background()) {
    write_png(out / "background.png", *background);
    sensor.background.image = "background.png";
  }
  save_sensor(sensor, out / "sensor.json");

  LineFile truth_file(out / "truth.csv");
  truth_file.append(std::string(kTruthHeader) + (scene.moves ? kMotionHeader : ""));
  LineFile contacts_file(out / "truth_contacts.csv");
  contacts_file.append(kContactsHeader);
  std::optional<LineFile> gauge_file;
  if (scene.block_force_N) gauge_file.emplace(out / "gauge.csv").append("frame,force_N");
  ProgressBar progress(common, "simulating", total);
  Frame frame;
  uint64_t done = 0;
  while (done < total && !interrupted() && source.next(frame)) {
    const std::optional<Truth> truth = source.truth(frame.sequence);
    write_png(out / "frames" / numbered_name(frame.sequence, "png"), frame);
    if (options.depth) {
      write_npy(out / "depth" / numbered_name(frame.sequence, "npy"), truth->depth_mm,
                {frame.format.height, frame.format.width});
    }
    truth_file.append(truth_row(*truth) + (scene.moves ? motion_cells(*truth) : ""));
    append_contacts(contacts_file, *truth);
    if (gauge_file)
      gauge_file->append(std::to_string(frame.sequence) + "," +
                         shortest(scene.block_force_N(frame.sequence)));
    progress.update(++done);
  }
  truth_file.close();
  contacts_file.close();
  if (gauge_file) gauge_file->close();

  const bool complete = done == total;
  json::Value value = {{"input", scene.input},
                       {"complete", complete},
                       {"frames", done},
                       {"frames_folder", (out / "frames").string()},
                       {"sensor", (out / "sensor.json").string()},
                       {"truth", (out / "truth.csv").string()},
                       {"truth_contacts", (out / "truth_contacts.csv").string()}};
  if (gauge_file) value["gauge"] = (out / "gauge.csv").string();
  std::string text = std::to_string(done) + " frames in " + (out / "frames").string() +
                     (complete ? "" : " (ended early)") + "\nmeasure them: palpate process " +
                     (out / "frames").string() + " --sensor " + (out / "sensor.json").string() + " --rate " +
                     shortest(source.rate_Hz()) + " --out " + (out / "measured").string();
  if (gauge_file) text += scene.block + " --gauge " + (out / "gauge.csv").string();
  return {text, value, complete ? 0 : kInterrupted};
}

}  // namespace

void add_simulate(CommandLine& program, Common& common, Command& chosen) {
  CommandLine* command = program.add_subcommand("simulate", "Write a synthetic recording with its truth");
  auto options = std::make_shared<Options>();
  SyntheticOptions& synthetic = options->synthetic;
  std::string scenes;
  for (const auto& [name, description] : synthetic_scenes())
    scenes.append("  ")
        .append(name)
        .append(12 - std::min<size_t>(11, name.size()), ' ')
        .append(description)
        .append("\n");
  scenes +=
      std::string("  object      ") + kObjectScene +
      ";\n              'object?shape=bead&path=roll' names keys of its own, capture/README.md lists them\n";
  scenes += std::string("  tissue      ") + kTissueScene +
            ";\n              gauge.csv is the force on the block; 'tissue?d=6&h=4' names keys of its own\n";
  command->add_option("SCENE", synthetic.scene, "What happens (listed below)")->required();
  command
      ->add_option(
          "--out", common.out,
          "Folder for frames/, truth.csv, truth_contacts.csv, sensor.json, background.png, of tissue "
          "gauge.csv")
      ->required();
  command->add_option("--size", options->size, "WIDTHxHEIGHT, px")->capture_default_str();
  command->add_setting("--bits", synthetic.bit_depth, Check::range(8, 16),
                       "Bits of a pixel, 8 to 16 (gel: 8)");
  command->add_setting("--mode", options->mode, Check::one_of({"waveguide", "gel", "lambert"}),
                       "waveguide (glows with pressure), gel (three colours), lambert (gray shading)");
  command->add_setting("--response", options->response, Check::one_of({"linear", "saturating"}),
                       "Pressure to light: linear, saturating");
  command->add_setting(
      "--skin", options->skin, Check::one_of({"none", "markers", "texture"}),
      "Pattern that shows how the skin shears: none, markers, texture (from 320 px width on)");
  command
      ->add_option("--hysteresis", synthetic.hysteresis,
                   "Waveguide: extra light while unloading, as a fraction of the largest force")
      ->capture_default_str();
  command
      ->add_option("--drift", synthetic.drift_per_min,
                   "Waveguide: fraction by which the light grows each minute")
      ->capture_default_str();
  command->add_option("--rate", synthetic.rate_Hz, "Frames a second")->capture_default_str();
  command
      ->add_option("--repeat", synthetic.repeat,
                   "Repeat the scene that many times; 0: until --frames or --seconds")
      ->capture_default_str();
  CommandOption* frames = command->add_option("--frames", options->frames, "At most that many frames");
  command->add_option("--seconds", options->seconds, "At most that long")
      ->excludes(frames)
      ->check(Check::positive());
  command->add_option("--force", synthetic.force_N, "Largest force, N (default: the scene's)");
  command->add_option("--radius", synthetic.indenter_radius_mm, "Indenter radius, mm (default: the scene's)");
  command->add_flag("--noiseless", options->noiseless, "No shot, read or fixed-pattern noise");
  command->add_flag("--depth", options->depth,
                    "Write the true depth maps too: depth/NNNNNN.npy, float32, mm");
  add_common(*command, common,
             "  palpate simulate press --out out/rec\n"
             "  palpate simulate palpation --out out/rec --size 1392x1042 --bits 12 --seed 7\n"
             "  palpate simulate slide --mode gel --seconds 3 --depth --out out/gel\n"
             "  palpate simulate drag --skin texture --out out/drag\n"
             "  palpate simulate rig --hysteresis 0.04 --drift 0.01 --out out/rig\n"
             "  palpate simulate tissue --out out/tissue\n"
             "  palpate simulate 'object?shape=bead&path=roll' --size 320x240 --out out/bead\n"
             "Scenes:\n" +
                 scenes +
                 "Frames are lossless PNG (more than 8 bits: 16-bit files with the value in the low bits); "
                 "numbered files of\n"
                 "an earlier run in frames/ and depth/ are replaced. truth.csv is whole up to the last frame "
                 "written.\n");
  command->runs(chosen, [&common, options] { return simulate(common, *options); });
}

}  // namespace palpate

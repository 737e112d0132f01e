#include "capture/run/input.h"

#include "capture/session/session.h"
#include "capture/synthetic/synthetic.h"
#include "capture/synthetic/tissue.h"
#include "capture/v4l2/camera.h"
#include "palpate/error.h"

namespace palpate {

MeasuredInput find_input(uint64_t seed, const std::string& input, const std::filesystem::path& sensor_file,
                         const std::filesystem::path& background) {
  constexpr const char* kSynthetic = "synthetic:";
  MeasuredInput found{.input = input, .sensor = {}, .session = {}};
  const bool synthetic = input.rfind(kSynthetic, 0) == 0;
  if (is_session(input)) found.session = Session(input).info();
  if (!sensor_file.empty()) {
    found.sensor = load_sensor(sensor_file);
  } else if (is_camera(input)) {
    found.sensor = uncalibrated_sensor(camera_format(parse_camera(input)));
  } else if (found.session) {
    found.sensor = found.session->sensor.value_or(uncalibrated_sensor(found.session->format));
  } else if (!synthetic) {
    throw Error(Failure::Usage, "--sensor FILE for '" + input + "'", "none",
                "a sensor file as engine/sensor/README.md describes it");
  }
  if (is_tissue(input)) {
    TissueOptions options = parse_tissue(input);
    if (input.find("seed=") == std::string::npos) options.seed = seed;
    found.input = to_string(options);
    if (sensor_file.empty()) found.sensor = tissue_sensor(options);
  } else if (synthetic) {
    SyntheticOptions options = parse_synthetic(input);
    if (input.find("seed=") == std::string::npos) options.seed = seed;
    found.input = to_string(options);
    if (sensor_file.empty()) found.sensor = synthetic_sensor(options);
  }
  if (!background.empty()) found.sensor.background.image = std::filesystem::absolute(background).string();
  found.outputs = Output::Force | Output::Contacts;
  if (found.sensor.skin && found.sensor.background.kind == BackgroundKind::Untouched)
    found.outputs |= static_cast<uint32_t>(Output::Skin);
  if (found.sensor.reconstruction != Reconstruction::None)
    found.outputs |= static_cast<uint32_t>(Output::Surface);
  return found;
}

const char* to_string(SurfaceSolver solver) {
  for (const auto& [name, value] : kSolverNames) {
    if (value == solver) return name.c_str();
  }
  return "";
}

}  // namespace palpate

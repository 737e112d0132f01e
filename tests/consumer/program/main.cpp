// consumer FOLDER: measures FOLDER/0.pgm, 1.pgm, ... with FOLDER/sensor.json and prints a row for each.
#include <palpate/device.h>
#include <palpate/error.h>
#include <palpate/pipeline.h>
#include <palpate/sensor.h>
#include <palpate/version.h>

#include <cstdio>
#include <fstream>
#include <string>

/// A gray image of 8 bits; false where there is none.
static bool read_pgm(const std::string& file, palpate::Frame& frame) {
  std::ifstream in(file, std::ios::binary);
  std::string kind;
  palpate::FrameFormat format;
  uint32_t white = 0;
  if (!(in >> kind >> format.width >> format.height >> white) || kind != "P5" || white != 255) return false;
  in.get();
  frame.reshape(format);
  return static_cast<bool>(
      in.read(reinterpret_cast<char*>(frame.bytes.data()), static_cast<std::streamsize>(frame.bytes.size())));
}

int main(int, char** arguments) try {
  const std::string folder = std::string(arguments[1]) + "/";
  palpate::Frame frame;
  if (!read_pgm(folder + "background.pgm", frame)) return 1;

  palpate::Device device;
  const palpate::Sensor sensor = palpate::load_sensor(folder + "sensor.json");
  palpate::Pipeline pipeline(
      device, sensor, frame.format,
      {.outputs = palpate::Output::Force | palpate::Output::Surface, .solver = palpate::SurfaceSolver::Best});
  pipeline.set_background(frame);
  for (int i = 0; read_pgm(folder + std::to_string(i) + ".pgm", frame); ++i) {
    const palpate::Result result = pipeline.process(frame);
    const palpate::Touch& touch = result.touch;
    std::printf("%.17g,%.17g,%.17g,%s\n", touch.gray_sum, touch.force_N.value, touch.surface->depth_max_mm,
                palpate::to_string(touch.force_N.validity));
  }
  return 0;
} catch (const palpate::Error& error) {
  std::fprintf(stderr, "%s: %s\n", PALPATE_VERSION_TEXT, error.what());
  return error.exit_code();
}

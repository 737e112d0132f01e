// palpate_consumer_frames FOLDER: a simulated press as PGM files, with its untouched image and sensor file.
#include <fstream>

#include "capture/synthetic/synthetic.h"
#include "palpate/error.h"

namespace {

void write_pgm(const std::string& file, const palpate::Frame& frame) {
  std::ofstream out(file, std::ios::binary);
  out << "P5\n" << frame.format.width << ' ' << frame.format.height << "\n255\n";
  out.write(reinterpret_cast<const char*>(frame.pixels()),
            static_cast<std::streamsize>(frame.format.frame_bytes()));
}

}  // namespace

int main(int, char** arguments) {
  const std::string folder = std::string(arguments[1]) + "/";
  const palpate::SyntheticOptions options = palpate::parse_synthetic("synthetic:press?size=320x240&rate=2");
  palpate::SyntheticSensor source(options);
  palpate::Sensor sensor = palpate::synthetic_sensor(options);
  sensor.background.image = folder + "background.pgm";
  palpate::save_sensor(sensor, folder + "sensor.json");
  write_pgm(sensor.background.image, *source.own_background());
  palpate::Frame frame;
  while (source.next(frame)) write_pgm(folder + std::to_string(frame.sequence) + ".pgm", frame);
  return 0;
}

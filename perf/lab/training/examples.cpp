#include "perf/lab/training/examples.h"

#include "palpate/error.h"

namespace palpate::lump {

std::vector<Example> lump_examples(const Data& data) {
  std::vector<Example> examples;
  for (const Sample& sample : data.samples) {
    if (sample.pressure_Pa.empty()) continue;
    Example e;
    e.lump = sample.what.lump.has_value();
    if (e.lump) {
      const Case::Lump& lump = *sample.what.lump;
      e.shape = lump.shape;
      e.along_y = lump.along_y;
      e.size_mm = lump.diameter_mm;
      e.depth_mm = lump.depth_mm;
      e.stiffness_ratio = lump.stiffness_ratio;
      e.offset_mm = lump.offset_mm;
    }
    e.block_mm = {data.sweep.block_mm[0], data.sweep.block_mm[1], sample.what.thickness_mm};
    e.young_Pa = sample.what.young_Pa;
    e.skin = sample.what.skin;
    e.plate_sticks = sample.what.plate_sticks;
    e.plate_friction = sample.what.plate_friction;
    e.cell_mm = data.sweep.block_mm[0] / data.sweep.cells[0];
    e.pressure_Pa = sample.pressure_Pa;
    e.force_N.assign(sample.force_N.begin(),
                     sample.force_N.begin() + static_cast<std::ptrdiff_t>(sample.pressure_Pa.size()));
    e.press_mm = sample.what.press_mm;
    e.press_mm.resize(e.force_N.size());
    examples.push_back(std::move(e));
  }
  return examples;
}

std::vector<Example> read_examples(const std::string& file) {
  std::vector<Example> examples = lump_examples(read_lump_file(file));
  if (examples.empty())
    throw Error(Failure::Input, "a data set with a finished case", file + " without one",
                "palpate-lab info " + file);
  return examples;
}

}  // namespace palpate::lump

// A data set of pressed lumps as one HDF5 file, for the training of models and for other programs.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "perf/lab/dataset/sample.h"

namespace palpate::lump {

/// Attributes of the file: `schema` "palpate lump dataset", `schema_version` "1", `program`, `sweep` (JSON:
/// all ranges with their units, seed, grid, loads, the solver's options), `seed`.
/// Datasets, N cases, L loads, W x H nodes of the surface, each with attributes `units` and
/// `description`:
///   number (N), state (N), shape (N), axis (N), diameter_mm (N), size_mm (N x 3), depth_mm (N),
///   stiffness_ratio (N), offset_mm (N x 2), thickness_mm (N), block_mm (N x 2), young_Pa (N), poisson (N),
///   press_mm (N x L), force_N (N x L), residual (N x L), least_volume_ratio (N x L),
///   last_good_press_mm (N), last_good_force_N (N), steps, cuts, newton_rounds, iterations (N),
///   x_mm (W), y_mm (H), pressure_Pa (N x L x H x W); of blocks with two lumps also second_shape,
///   second_axis, second_diameter_mm, second_depth_mm, second_stiffness_ratio (N), second_offset_mm (N x 2).
/// NaN: there is no lump, or the load was not reached. All have check sums; the same cases make the same
/// bytes, whoever made them and when.
struct Data {
  Sweep sweep;
  std::string program;          ///< that solved it
  uint32_t first = 0;           ///< number of the first case
  std::vector<Sample> samples;  ///< rising by 1
};

/// Writes the cases [first, first + count), each asked for once in turn; one that is not done keeps its row.
/// The file appears whole under its name, on the disk. Throws Error(Failure::Output).
void write_lump_file(const std::filesystem::path& path, const Sweep& sweep, const std::string& program,
                     uint32_t first, uint32_t count, const std::function<Sample(uint32_t)>& sample);

/// Throws Error(Failure::Input) for what is no such file, of another version, cut off or damaged.
Data read_lump_file(const std::filesystem::path& path);

}  // namespace palpate::lump

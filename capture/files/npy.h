// NumPy's array files (.npy), versions 1.0 and 2.0: the format in which arrays are exchanged with other
// programs.
#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

namespace palpate {

/// An array of floats, last index fastest.
struct NpyArray {
  std::vector<size_t> shape;
  std::vector<float> values;
};

/// Largest array that is read, in elements: three times the largest frame.
inline constexpr size_t kMaxNpyElements = size_t{3} * 16384 * 16384;

/// Reads float32 or float64 (rounded to float32), little endian, C order.
/// Throws Error(Failure::Input) that says what the file holds instead: other types, Fortran order, a header
/// that lies about the size, a value that does not fit float32. NaN and infinity pass; judging them is the
/// caller's.
NpyArray read_npy(const std::filesystem::path& file);

/// Writes float32 in C order, in one step. The product of `shape` is the number of values. Throws
/// Error(Failure::Output).
void write_npy(const std::filesystem::path& file, std::span<const float> values,
               const std::vector<size_t>& shape);

/// "480 x 640 x 2".
std::string describe_shape(const std::vector<size_t>& shape);

}  // namespace palpate

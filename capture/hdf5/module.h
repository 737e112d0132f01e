// Interface of the module that needs libhdf5: files of growing datasets.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

namespace palpate {

enum class Hdf5Type : uint8_t { U8, U16, U64, F32, F64, Text };

/// A dataset that grows row by row along its first side.
struct Hdf5Dataset {
  std::string path;  ///< "/touch/force_N"; its groups are made
  Hdf5Type type = Hdf5Type::F64;
  std::vector<uint64_t> row =
      {};                 ///< sides of one row; empty: one value. Rows with sides are chunks of their own
  std::string unit = {};  ///< attributes
  std::string description = {};
};

/// Every member throws Error(Failure::Output).
class Hdf5Writer {
 public:
  virtual ~Hdf5Writer() = default;
  /// Its number, for append().
  virtual size_t add(const Hdf5Dataset& dataset) = 0;
  /// One row of a dataset of numbers, in their memory's form.
  virtual void append(size_t dataset, const void* row) = 0;
  virtual void append_text(size_t dataset, const std::string& text) = 0;
  /// An attribute of the file.
  virtual void attribute(const std::string& name, const std::string& text) = 0;
  virtual void close() = 0;
};

/// Makes the file, or empties it. Loads the module at its first call; throws Error(Failure::Input) where it
/// is missing.
std::unique_ptr<Hdf5Writer> write_hdf5(const std::filesystem::path& file);

}  // namespace palpate

// HDF5 for data sets: kinds of numbers, silence, attributes that are read.
#pragma once

#include <hdf5.h>

#include <string>
#include <vector>

#include "capture/hdf5/module/handle.h"

namespace palpate::lump {

using palpate::Hdf5;

/// Kind of a stored number: little endian whatever the machine.
template <typename Number>
struct Hdf5Kind;
template <>
struct Hdf5Kind<float> {
  static hid_t memory() { return H5T_NATIVE_FLOAT; }
  static hid_t file() { return H5T_IEEE_F32LE; }
};
template <>
struct Hdf5Kind<double> {
  static hid_t memory() { return H5T_NATIVE_DOUBLE; }
  static hid_t file() { return H5T_IEEE_F64LE; }
};
template <>
struct Hdf5Kind<uint32_t> {
  static hid_t memory() { return H5T_NATIVE_UINT32; }
  static hid_t file() { return H5T_STD_U32LE; }
};
template <>
struct Hdf5Kind<int8_t> {
  static hid_t memory() { return H5T_NATIVE_INT8; }
  static hid_t file() { return H5T_STD_I8LE; }
};

/// Keeps the HDF5 library from printing its errors, in this thread: ours are reported as Error.
class Hdf5Quiet {
 public:
  Hdf5Quiet();
  ~Hdf5Quiet();
  Hdf5Quiet(const Hdf5Quiet&) = delete;
  Hdf5Quiet& operator=(const Hdf5Quiet&) = delete;

 private:
  H5E_auto2_t print_ = nullptr;
  void* data_ = nullptr;
};

/// Empty where there is none.
std::string text_attribute(hid_t object, const char* name);

}  // namespace palpate::lump

// HDF5's handles as values that close themselves, its failures as our errors.
#pragma once

#include <hdf5.h>

#include <string>
#include <utility>
#include <vector>

namespace palpate::lump {

/// A handle that an H5...open or H5...create returned, closed by its own function.
class Hdf5 {
 public:
  Hdf5(hid_t id, herr_t (*close)(hid_t)) : id_(id), close_(close) {}
  Hdf5(Hdf5&& other) noexcept : id_(std::exchange(other.id_, -1)), close_(other.close_) {}
  Hdf5& operator=(Hdf5&& other) noexcept {
    std::swap(id_, other.id_);
    std::swap(close_, other.close_);
    return *this;
  }
  ~Hdf5() {
    if (id_ >= 0) close_(id_);
  }
  operator hid_t() const { return id_; }  // NOLINT(google-explicit-constructor): as C's functions want it
  bool good() const { return id_ >= 0; }

 private:
  hid_t id_;
  herr_t (*close_)(hid_t);
};

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

/// Innermost error of the last call that failed.
std::string hdf5_reason();

/// A text as attribute of a file or a dataset. False where it failed.
bool put_attribute(hid_t object, const char* name, const std::string& text);
/// Empty where there is none.
std::string text_attribute(hid_t object, const char* name);

}  // namespace palpate::lump

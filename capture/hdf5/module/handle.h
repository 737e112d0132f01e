// HDF5's handles as values that close themselves, the reason of a failure, texts as attributes. The
// laboratory's data sets use it too.
#pragma once

#include <hdf5.h>

#include <string>
#include <utility>

namespace palpate {

/// A handle that an H5...open or H5...create returned, closed by its own function.
class Hdf5 {
 public:
  Hdf5(hid_t id, herr_t (*by)(hid_t)) : id_(id), close_(by) {}
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
  /// False where the library refuses.
  bool close() { return id_ < 0 || close_(std::exchange(id_, -1)) >= 0; }

 private:
  hid_t id_;
  herr_t (*close_)(hid_t);
};

/// Innermost error of the last call that failed.
inline std::string hdf5_reason() {
  std::string reason;
  const auto keep = [](unsigned, const H5E_error2_t* error, void* to) -> herr_t {
    if (error->desc != nullptr) *static_cast<std::string*>(to) = error->desc;
    return 0;
  };
  H5Ewalk2(H5E_DEFAULT, H5E_WALK_DOWNWARD, keep, &reason);
  return reason.empty() ? "no reason from HDF5" : reason;
}

/// The type of texts. Of variable length: other readers take those of a fixed one for bytes without an
/// encoding.
inline Hdf5 text_type() {
  Hdf5 kind(H5Tcopy(H5T_C_S1), H5Tclose);
  if (kind.good() && (H5Tset_size(kind, H5T_VARIABLE) < 0 || H5Tset_cset(kind, H5T_CSET_UTF8) < 0))
    kind.close();
  return kind;
}

/// A text as attribute of a file or a dataset. False where it failed.
inline bool put_attribute(hid_t object, const char* name, const std::string& text) {
  const Hdf5 kind = text_type(), space(H5Screate(H5S_SCALAR), H5Sclose);
  if (!kind.good() || !space.good()) return false;
  const Hdf5 attribute(H5Acreate2(object, name, kind, space, H5P_DEFAULT, H5P_DEFAULT), H5Aclose);
  const char* const value = text.c_str();
  return attribute.good() && H5Awrite(attribute, kind, static_cast<const void*>(&value)) >= 0;
}

}  // namespace palpate

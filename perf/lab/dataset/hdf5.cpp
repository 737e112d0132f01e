#include "perf/lab/dataset/hdf5.h"

namespace palpate::lump {

Hdf5Quiet::Hdf5Quiet() {
  // After a damaged file the library's own end finds handles that it cannot close, and prints so.
  [[maybe_unused]] static const herr_t kNoEnd = H5dont_atexit();
  H5Eget_auto2(H5E_DEFAULT, &print_, &data_);
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
}

Hdf5Quiet::~Hdf5Quiet() {
  H5Eset_auto2(H5E_DEFAULT, print_, data_);
}

std::string text_attribute(hid_t object, const char* name) {
  if (H5Aexists(object, name) <= 0) return {};
  const Hdf5 attribute(H5Aopen(object, name, H5P_DEFAULT), H5Aclose);
  if (!attribute.good()) return {};
  const Hdf5 kind(H5Aget_type(attribute), H5Tclose);
  if (!kind.good() || H5Tget_class(kind) != H5T_STRING) return {};
  if (H5Tis_variable_str(kind) > 0) {
    char* value = nullptr;
    if (H5Aread(attribute, kind, static_cast<void*>(&value)) < 0 || value == nullptr) return {};
    std::string text = value;
    H5free_memory(value);
    return text;
  }
  const size_t bytes = H5Tget_size(kind);
  if (bytes == 0 || bytes > (1u << 20)) return {};
  std::string text(bytes, '\0');
  if (H5Aread(attribute, kind, text.data()) < 0) return {};
  return text.substr(0, text.find('\0'));
}

}  // namespace palpate::lump

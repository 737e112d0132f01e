// Files of HDF5, by its C library.
#include <algorithm>
#include <utility>

#include "capture/hdf5/module.h"
#include "capture/hdf5/module/handle.h"
#include "palpate/error.h"

namespace palpate {
namespace {

/// The type of a value in memory, which is that in the file: little endian.
hid_t number_type(Hdf5Type type) {
  switch (type) {
    case Hdf5Type::U8:
      return H5T_STD_U8LE;
    case Hdf5Type::U16:
      return H5T_STD_U16LE;
    case Hdf5Type::U64:
      return H5T_STD_U64LE;
    case Hdf5Type::F32:
      return H5T_IEEE_F32LE;
    default:
      return H5T_IEEE_F64LE;
  }
}

/// Rows of single values wait for so many of their kind.
constexpr hsize_t kRowsOfChunk = 1024;

struct Column {
  Hdf5 set;
  Hdf5 type;
  std::vector<hsize_t> row;  ///< sides of the next row, the first 1
  hsize_t written = 0;
};

/// The library would print its errors, and at the program's end what it cannot close.
bool be_quiet() {
  static const bool kNoEnd = H5dont_atexit() >= 0;  // once, before anything else
  return kNoEnd && H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr) >= 0;
}

class Writer : public Hdf5Writer {
 public:
  explicit Writer(std::filesystem::path path)
      : path_(std::move(path)),
        quiet_(be_quiet()),
        file_(H5Fcreate(path_.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT), H5Fclose) {
    need(quiet_ && file_ >= 0);
  }

  size_t add(const Hdf5Dataset& dataset) override {
    std::vector<hsize_t> row(dataset.row.begin(), dataset.row.end());
    row.insert(row.begin(), 1);
    std::vector<hsize_t> none = row, most = row, chunk = row;
    none[0] = 0;
    most[0] = H5S_UNLIMITED;
    if (row.size() == 1) chunk[0] = kRowsOfChunk;
    const int rank = static_cast<int>(row.size());
    const bool is_text = dataset.type == Hdf5Type::Text;
    const Hdf5 space(H5Screate_simple(rank, none.data(), most.data()), H5Sclose);
    const Hdf5 how(H5Pcreate(H5P_DATASET_CREATE), H5Pclose), groups(H5Pcreate(H5P_LINK_CREATE), H5Pclose);
    need(H5Pset_obj_track_times(how, false) >= 0 && H5Pset_chunk(how, rank, chunk.data()) >= 0 &&
         H5Pset_create_intermediate_group(groups, 1) >= 0);
    if (!is_text)
      need(H5Pset_shuffle(how) >= 0 && H5Pset_deflate(how, 1) >= 0 && H5Pset_fletcher32(how) >= 0);
    Hdf5 type = is_text ? text_type() : Hdf5(H5Tcopy(number_type(dataset.type)), H5Tclose);
    Hdf5 set(H5Dcreate2(file_, dataset.path.c_str(), type, space, groups, how, H5P_DEFAULT), H5Dclose);
    need(set >= 0);
    need(put_attribute(set, "unit", dataset.unit) && put_attribute(set, "description", dataset.description));
    columns_.push_back({std::move(set), std::move(type), std::move(row)});
    return columns_.size() - 1;
  }

  void append(size_t dataset, const void* values) override {
    Column& column = columns_.at(dataset);
    std::vector<hsize_t> size = column.row, begin(size.size(), 0);
    begin[0] = column.written;
    size[0] = column.written + 1;
    need(H5Dset_extent(column.set, size.data()) >= 0);
    const Hdf5 space(H5Dget_space(column.set), H5Sclose);
    const Hdf5 memory(H5Screate_simple(static_cast<int>(size.size()), column.row.data(), nullptr), H5Sclose);
    need(H5Sselect_hyperslab(space, H5S_SELECT_SET, begin.data(), nullptr, column.row.data(), nullptr) >= 0 &&
         H5Dwrite(column.set, column.type, memory, space, H5P_DEFAULT, values) >= 0);
    ++column.written;
  }

  void append_text(size_t dataset, const std::string& text) override {
    const char* const value = text.c_str();
    append(dataset, static_cast<const void*>(&value));
  }

  void attribute(const std::string& name, const std::string& text) override {
    need(put_attribute(file_, name.c_str(), text));
  }

  void close() override {
    for (Column& column : columns_) need(column.set.close());
    need(H5Fflush(file_, H5F_SCOPE_GLOBAL) >= 0 && file_.close());
  }

 private:
  void need(bool good) const {
    if (good) return;
    std::string reason = hdf5_reason();
    std::ranges::replace(reason, '\n', ' ');
    throw Error(Failure::Output, "to write '" + path_.string() + "'", reason,
                "another place, or freeing disk space");
  }

  std::filesystem::path path_;
  bool quiet_;
  Hdf5 file_;
  std::vector<Column> columns_;
};

std::unique_ptr<Hdf5Writer> make(const std::filesystem::path& file) {
  return std::make_unique<Writer>(file);
}

}  // namespace
}  // namespace palpate

using MakeWriter = std::unique_ptr<palpate::Hdf5Writer> (*)(const std::filesystem::path& file);

extern "C" __attribute__((visibility("default"))) MakeWriter palpate_hdf5_writer() {
  return &palpate::make;
}

#include "perf/lab/dataset/file.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cmath>
#include <limits>

#include "engine/base/readable.h"
#include "palpate/error.h"
#include "perf/lab/dataset/hdf5.h"

namespace palpate::lump {
namespace {

constexpr const char* kSchema = "palpate lump dataset";
constexpr const char* kSchemaVersion = "1";
constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
constexpr hsize_t kCasesOfColumn = 1024;  // in one chunk

[[noreturn]] void cannot_write(const std::filesystem::path& path, const std::string& reason) {
  throw Error(Failure::Output, "to write '" + path.string() + "'", reason,
              "another place, or freeing disk space; what is done is kept");
}

/// A dataset that is being written, chunked along its first side, with check sums.
template <typename Number>
class Column {
 public:
  /// `row`: sizes of one case's values; empty: one value. `chunk`: cases in one chunk.
  Column(const std::filesystem::path& path, hid_t file, const char* name, hsize_t cases,
         std::vector<hsize_t> row, hsize_t chunk, const char* units, const char* description)
      : path_(path), sizes_(std::move(row)) {
    sizes_.insert(sizes_.begin(), cases);
    std::vector<hsize_t> chunks = sizes_;
    chunks[0] = std::min(chunk, cases);
    const int rank = static_cast<int>(sizes_.size());
    space_ = Hdf5(H5Screate_simple(rank, sizes_.data(), nullptr), H5Sclose);
    const Hdf5 how(H5Pcreate(H5P_DATASET_CREATE), H5Pclose);
    // Times of creation would differ from run to run; without them the same cases make the same bytes.
    if (H5Pset_obj_track_times(how, false) < 0 || H5Pset_chunk(how, rank, chunks.data()) < 0 ||
        H5Pset_shuffle(how) < 0 || H5Pset_deflate(how, 4) < 0 || H5Pset_fletcher32(how) < 0)
      fail();
    set_ = Hdf5(H5Dcreate2(file, name, Hdf5Kind<Number>::file(), space_, H5P_DEFAULT, how, H5P_DEFAULT),
                H5Dclose);
    if (!set_.good() || !put_attribute(set_, "units", units) ||
        !put_attribute(set_, "description", description))
      fail();
  }

  /// Values of one case after the other; they reach the file a chunk's worth at a time.
  void add(const Number* values, size_t count) { waiting_.insert(waiting_.end(), values, values + count); }
  void add(Number value) { waiting_.push_back(value); }
  void flush() {
    size_t row = 1;
    for (size_t i = 1; i < sizes_.size(); ++i) row *= sizes_[i];
    const hsize_t cases = waiting_.size() / row;
    if (cases == 0) return;
    std::vector<hsize_t> begin(sizes_.size(), 0), size = sizes_;
    begin[0] = written_;
    size[0] = cases;
    const Hdf5 memory(H5Screate_simple(static_cast<int>(size.size()), size.data(), nullptr), H5Sclose);
    if (H5Sselect_hyperslab(space_, H5S_SELECT_SET, begin.data(), nullptr, size.data(), nullptr) < 0 ||
        H5Dwrite(set_, Hdf5Kind<Number>::memory(), memory, space_, H5P_DEFAULT, waiting_.data()) < 0)
      fail();
    written_ += cases;
    waiting_.clear();
  }

 private:
  [[noreturn]] void fail() const { cannot_write(path_, hdf5_reason()); }

  std::filesystem::path path_;
  std::vector<hsize_t> sizes_;
  Hdf5 space_{-1, H5Sclose}, set_{-1, H5Dclose};
  std::vector<Number> waiting_;
  hsize_t written_ = 0;
};

/// All datasets of the file, in the order in which they stand there.
class Writer {
 public:
  Writer(const std::filesystem::path& path, hid_t file, const Sweep& s, hsize_t n)
      : path_(path),
        file_(file),
        n_(n),
        sweep_(s),
        number_(column<uint32_t>("number", {}, "1", "number of the case in the sweep")),
        state_(
            column<int8_t>("state", {}, "1",
                           "0: not done, 1: good, 2: not converged, loads up to the last good one are good")),
        shape_(
            column<int8_t>("shape", {}, "1",
                           "0: sphere, 1: ellipsoid, 2: upright cylinder, 3: lying cylinder, -1: no lump")),
        axis_(column<int8_t>("axis", {}, "1",
                             "long axis of ellipsoids and lying cylinders, 0: x, 1: y; -1: none")),
        diameter_(column("diameter_mm", {}, "mm", "diameter of the lump, of long ones the smaller")),
        size_(column("size_mm", {3}, "mm", "outer sizes of the lump along x, y, z")),
        depth_(column("depth_mm", {}, "mm", "from the tissue's surface to the lump's top")),
        ratio_(column("stiffness_ratio", {}, "1", "Young's modulus of the lump over the tissue's")),
        offset_(column("offset_mm", {2}, "mm", "x and y of the lump's centre from the block's middle")),
        thickness_(column("thickness_mm", {}, "mm", "of the tissue, on a rigid floor to which it is bonded")),
        block_(column("block_mm", {2}, "mm", "length (x) and width (y) of the tissue, its sides are free")),
        young_(column("young_Pa", {}, "Pa", "Young's modulus of the tissue")),
        poisson_(column("poisson", {}, "1", "Poisson's ratio of tissue and lump")),
        press_(column("press_mm", {s.loads}, "mm",
                      s.plate_slides() ? "way of the flat, frictionless plate at each load"
                                       : "way of the flat plate at each load, which rubs or sticks")),
        force_(column("force_N", {s.loads}, "N", "on the whole plate at each load")),
        residual_(column("residual", {s.loads}, "1", "forces out of balance over all forces")),
        volume_(
            column("least_volume_ratio", {s.loads}, "1", "smallest determinant of the deformation gradient")),
        last_press_(column("last_good_press_mm", {}, "mm", "how far the press came")),
        last_force_(column("last_good_force_N", {}, "N", "how far the press came")),
        steps_(column<uint32_t>("steps", {}, "1", "of the press")),
        cuts_(column<uint32_t>("cuts", {}, "1", "steps that were halved")),
        newton_(column<uint32_t>("newton_rounds", {}, "1", "of all steps")),
        iterations_(column<uint32_t>("iterations", {}, "1", "of conjugate gradients, of all rounds")),
        pressure_(
            path, file, "pressure_Pa", n, {s.loads, s.nodes[1], s.nodes[0]}, 1, "Pa",
            "true pressure on the plate (force over deformed area) at each load, in the plate's frame, at "
            "y_mm by x_mm") {
    const char* place = "of the nodes of pressure_Pa, from the block's middle";
    for (const size_t c : {0, 1}) {
      Column<double> places(path, file, c == 0 ? "x_mm" : "y_mm", s.nodes[c], {}, s.nodes[c], "mm", place);
      for (uint32_t i = 0; i < s.nodes[c]; ++i)
        places.add(s.block_mm[c] * (double(i) / (s.nodes[c] - 1) - 0.5));
      places.flush();
    }
    if (s.has_skin())
      skin_.emplace(Skin{column("skin_mm", {}, "mm", "thickness of the skin, part of thickness_mm"),
                         column("skin_ratio", {}, "1", "Young's modulus of the skin over the tissue's")});
    if (s.second_gap_mm > 0)
      second_.emplace(
          Second{column<int8_t>("second_shape", {}, "1", "the second lump's, as shape"),
                 column<int8_t>("second_axis", {}, "1", "the second lump's, as axis"),
                 column("second_diameter_mm", {}, "mm", "the second lump's, as diameter_mm"),
                 column("second_depth_mm", {}, "mm", "the second lump's, as depth_mm"),
                 column("second_stiffness_ratio", {}, "1", "the second lump's, as stiffness_ratio"),
                 column("second_offset_mm", {2}, "mm", "the second lump's, as offset_mm")});
  }

  void add(const Sample& sample) {
    const Case& what = sample.what;
    number_.add(what.number);
    state_.add(static_cast<int8_t>(sample.state));
    add_lump(what.lump, shape_, axis_, diameter_, depth_, ratio_, offset_);
    const std::array<double, 3> size = what.lump ? what.lump->size_mm() : std::array{kNone, kNone, kNone};
    size_.add(size.data(), 3);
    if (second_)
      add_lump(what.second, second_->shape, second_->axis, second_->diameter, second_->depth, second_->ratio,
               second_->offset);
    if (skin_) {
      skin_->thickness.add(what.skin->thickness_mm);
      skin_->ratio.add(what.skin->stiffness_ratio);
    }
    thickness_.add(what.thickness_mm);
    block_.add(sweep_.block_mm.data(), 2);
    young_.add(what.young_Pa);
    poisson_.add(sweep_.poisson);
    press_.add(what.press_mm.data(), sweep_.loads);
    for (const auto& [to, from] : {std::pair{&force_, &sample.force_N},
                                   {&residual_, &sample.residual},
                                   {&volume_, &sample.least_volume_ratio}})
      for (size_t l = 0; l < sweep_.loads; ++l) to->add(l < from->size() ? (*from)[l] : kNone);
    const bool done = sample.state != State::NotDone;
    last_press_.add(done ? sample.last_press_mm : kNone);
    last_force_.add(done ? sample.last_force_N : kNone);
    steps_.add(sample.steps);
    cuts_.add(sample.cuts);
    newton_.add(sample.newton_rounds);
    iterations_.add(sample.iterations);
    const size_t values = size_t{sweep_.nodes[0]} * sweep_.nodes[1];
    const std::vector<float> none(values, std::numeric_limits<float>::quiet_NaN());
    for (size_t l = 0; l < sweep_.loads; ++l)
      pressure_.add(l < sample.pressure_Pa.size() ? sample.pressure_Pa[l].values.data() : none.data(),
                    values);
    pressure_.flush();
    if (++added_ % kCasesOfColumn == 0) flush();
  }

  void flush() {
    for (auto* c : {&number_, &steps_, &cuts_, &newton_, &iterations_}) c->flush();
    for (auto* c : {&state_, &shape_, &axis_}) c->flush();
    for (auto* c : {&diameter_, &size_, &depth_, &ratio_, &offset_, &thickness_, &block_, &young_, &poisson_,
                    &press_, &force_, &residual_, &volume_, &last_press_, &last_force_})
      c->flush();
    if (skin_)
      for (auto* c : {&skin_->thickness, &skin_->ratio}) c->flush();
    if (second_) {
      for (auto* c : {&second_->shape, &second_->axis}) c->flush();
      for (auto* c : {&second_->diameter, &second_->depth, &second_->ratio, &second_->offset}) c->flush();
    }
    pressure_.flush();
  }

 private:
  struct Skin {
    Column<double> thickness, ratio;
  };
  struct Second {
    Column<int8_t> shape, axis;
    Column<double> diameter, depth, ratio, offset;
  };

  static void add_lump(const std::optional<Case::Lump>& lump, Column<int8_t>& shape, Column<int8_t>& axis,
                       Column<double>& diameter, Column<double>& depth, Column<double>& ratio,
                       Column<double>& offset) {
    const bool is = lump.has_value(), is_long = is && lump->size_mm()[0] != lump->size_mm()[1];
    shape.add(is ? static_cast<int8_t>(lump->shape) : int8_t{-1});
    axis.add(is_long ? int8_t{lump->along_y} : int8_t{-1});
    diameter.add(is ? lump->diameter_mm : kNone);
    depth.add(is ? lump->depth_mm : kNone);
    ratio.add(is ? lump->stiffness_ratio : kNone);
    const std::array<double, 2> place = is ? lump->offset_mm : std::array{kNone, kNone};
    offset.add(place.data(), 2);
  }

  template <typename Number = double>
  Column<Number> column(const char* name, std::vector<hsize_t> row, const char* units,
                        const char* description) {
    return Column<Number>(path_, file_, name, n_, std::move(row), kCasesOfColumn, units, description);
  }

  std::filesystem::path path_;
  hid_t file_;
  hsize_t n_, added_ = 0;
  Sweep sweep_;
  Column<uint32_t> number_;
  Column<int8_t> state_, shape_, axis_;
  Column<double> diameter_, size_, depth_, ratio_, offset_, thickness_, block_, young_, poisson_, press_,
      force_, residual_, volume_, last_press_, last_force_;
  Column<uint32_t> steps_, cuts_, newton_, iterations_;
  Column<float> pressure_;
  std::optional<Skin> skin_;
  std::optional<Second> second_;
};

}  // namespace

void write_lump_file(const std::filesystem::path& path, const Sweep& sweep, const std::string& program,
                     uint32_t first, uint32_t count, const std::function<Sample(uint32_t)>& sample) {
  const Hdf5Quiet quiet;
  const std::filesystem::path folder = path.parent_path().empty() ? "." : path.parent_path();
  const std::filesystem::path partial =
      folder / ("." + path.filename().string() + "." + std::to_string(::getpid()) + ".partial");
  try {
    // From this version on, the library adds check sums to its own tables too, not only to our values.
    const Hdf5 how(H5Pcreate(H5P_FILE_ACCESS), H5Pclose);
    if (H5Pset_libver_bounds(how, H5F_LIBVER_V110, H5F_LIBVER_V110) < 0) cannot_write(path, hdf5_reason());
    const Hdf5 timeless(H5Pcreate(H5P_FILE_CREATE), H5Pclose);
    if (H5Pset_obj_track_times(timeless, false) < 0) cannot_write(path, hdf5_reason());
    Hdf5 file(H5Fcreate(partial.c_str(), H5F_ACC_TRUNC, timeless, how), H5Fclose);
    if (!file.good()) cannot_write(path, hdf5_reason());
    if (!put_attribute(file, "schema", kSchema) || !put_attribute(file, "schema_version", kSchemaVersion) ||
        !put_attribute(file, "program", program) || !put_attribute(file, "sweep", to_json(sweep).dump()) ||
        !put_attribute(file, "seed", std::to_string(sweep.seed)))
      cannot_write(path, hdf5_reason());
    {
      Writer writer(path, file, sweep, count);
      for (uint32_t i = 0; i < count; ++i) writer.add(sample(first + i));
      writer.flush();
    }
    // Closing tells whether all of it went to the file.
    if (H5Fflush(file, H5F_SCOPE_LOCAL) < 0) cannot_write(path, hdf5_reason());
    file = Hdf5(-1, H5Fclose);
    const int held = ::open(partial.c_str(), O_RDONLY | O_CLOEXEC);
    if (held < 0 || (::fsync(held) != 0 && errno != EINVAL && errno != EROFS))
      cannot_write(path, system_words(errno));
    ::close(held);
    if (::rename(partial.c_str(), path.c_str()) != 0) cannot_write(path, system_words(errno));
    const int there = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (there >= 0) {
      ::fsync(there);
      ::close(there);
    }
  } catch (...) {
    ::unlink(partial.c_str());
    throw;
  }
}

}  // namespace palpate::lump

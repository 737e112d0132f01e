#include <cmath>
#include <filesystem>

#include "capture/files/tables/csv_table.h"
#include "palpate/error.h"
#include "perf/lab/dataset/file.h"
#include "perf/lab/dataset/hdf5.h"

namespace palpate::lump {
namespace {

/// Reads datasets whole and says what is wrong with the file otherwise.
class Reader {
 public:
  explicit Reader(const std::filesystem::path& path) : path_(path) {
    std::error_code error;
    if (!std::filesystem::exists(path, error)) refuse("nothing");
    file_ = Hdf5(H5Fopen(path.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT), H5Fclose);
    if (!file_.good()) refuse("what HDF5 cannot open: " + hdf5_reason());
  }

  [[noreturn]] void refuse(const std::string& found) const {
    throw Error(Failure::Input, "a data set of lumps in '" + path_.string() + "'", found,
                "a file that `palpate-lab dataset` wrote");
  }

  std::string text(const char* name) const { return text_attribute(file_, name); }

  hsize_t cases() const {
    const Hdf5 set = open("number");
    const Hdf5 space(H5Dget_space(set), H5Sclose);
    hsize_t n = 0;
    if (H5Sget_simple_extent_ndims(space) != 1 || H5Sget_simple_extent_dims(space, &n, nullptr) < 0)
      refuse("`number` of another size");
    return n;
  }

  /// All values; refuses other sizes than these.
  template <typename Number>
  std::vector<Number> values(const char* name, const std::vector<hsize_t>& sizes) const {
    const Hdf5 set = open(name);
    size_t count = check_size(set, name, sizes);
    std::vector<Number> numbers(count);
    if (count != 0 &&
        H5Dread(set, Hdf5Kind<Number>::memory(), H5S_ALL, H5S_ALL, H5P_DEFAULT, numbers.data()) < 0)
      refuse("`" + std::string(name) + "` that cannot be read: " + hdf5_reason());
    return numbers;
  }

  /// One dataset, its cases one by one.
  class Rows {
   public:
    Rows(const Reader& reader, const char* name, std::vector<hsize_t> sizes)
        : reader_(reader),
          name_(name),
          set_(reader.open(name)),
          space_(H5Dget_space(set_), H5Sclose),
          sizes_(std::move(sizes)) {
      reader_.check_size(set_, name, sizes_);
    }
    std::vector<float> read(hsize_t row) {
      std::vector<hsize_t> begin(sizes_.size(), 0), size = sizes_;
      begin[0] = row;
      size[0] = 1;
      size_t count = 1;
      for (const hsize_t n : size) count *= n;
      std::vector<float> numbers(count);
      const Hdf5 memory(H5Screate_simple(static_cast<int>(size.size()), size.data(), nullptr), H5Sclose);
      if (H5Sselect_hyperslab(space_, H5S_SELECT_SET, begin.data(), nullptr, size.data(), nullptr) < 0 ||
          H5Dread(set_, H5T_NATIVE_FLOAT, memory, space_, H5P_DEFAULT, numbers.data()) < 0)
        reader_.refuse("`" + std::string(name_) + "` that cannot be read at case " + std::to_string(row) +
                       ": " + hdf5_reason());
      return numbers;
    }

   private:
    const Reader& reader_;
    const char* name_;
    Hdf5 set_, space_;
    std::vector<hsize_t> sizes_;
  };

 private:
  Hdf5 open(const char* name) const {
    Hdf5 set(H5Dopen2(file_, name, H5P_DEFAULT), H5Dclose);
    if (!set.good()) refuse("no `" + std::string(name) + "` in it");
    return set;
  }

  size_t check_size(hid_t set, const char* name, const std::vector<hsize_t>& sizes) const {
    const Hdf5 space(H5Dget_space(set), H5Sclose);
    std::vector<hsize_t> found(sizes.size());
    if (H5Sget_simple_extent_ndims(space) != static_cast<int>(sizes.size()) ||
        H5Sget_simple_extent_dims(space, found.data(), nullptr) < 0 || found != sizes)
      refuse("`" + std::string(name) + "` of another size");
    size_t count = 1;
    for (const hsize_t n : sizes) count *= n;
    return count;
  }

  std::filesystem::path path_;
  Hdf5 file_{-1, H5Fclose};
};

/// The same but for the last digits, which mathematical libraries round as they like.
bool same(double a, double b) {
  return std::abs(a - b) <= 1e-9 * std::abs(b) || (std::isnan(a) && std::isnan(b));
}

}  // namespace

Data read_lump_file(const std::filesystem::path& path) {
  const Hdf5Quiet quiet;
  const Reader file(path);
  if (file.text("schema") != "palpate lump dataset") file.refuse("another kind of file");
  if (file.text("schema_version") != "1")
    file.refuse("version " + printable(file.text("schema_version")) + " of it, not 1");
  Data data;
  data.program = file.text("program");
  data.sweep = sweep_from_json(file.text("sweep"));
  const Sweep& s = data.sweep;
  const hsize_t n = file.cases(), loads = s.loads, width = s.nodes[0], height = s.nodes[1];
  if (n == 0 || n > UINT32_MAX) file.refuse("no cases");

  const auto number = file.values<uint32_t>("number", {n});
  const auto state = file.values<int8_t>("state", {n}), shape = file.values<int8_t>("shape", {n});
  const auto column = [&](const char* name) { return file.values<double>(name, {n}); };
  const auto table = [&](const char* name) { return file.values<double>(name, {n, loads}); };
  const auto counts = [&](const char* name) { return file.values<uint32_t>(name, {n}); };
  const auto diameter = column("diameter_mm"), depth = column("depth_mm"), ratio = column("stiffness_ratio");
  const auto thickness = column("thickness_mm"), young = column("young_Pa");
  const auto last_press = column("last_good_press_mm"), last_force = column("last_good_force_N");
  const auto force = table("force_N"), residual = table("residual"), volume = table("least_volume_ratio");
  const auto steps = counts("steps"), cuts = counts("cuts"), newton = counts("newton_rounds"),
             iterations = counts("iterations");
  std::vector<double> second_diameter(n, NAN), second_ratio(n, NAN);
  if (s.second_gap_mm > 0) {
    second_diameter = column("second_diameter_mm");
    second_ratio = column("second_stiffness_ratio");
  }
  std::vector<double> skin(n, NAN), skin_ratio(n, NAN);
  if (s.has_skin()) {
    skin = column("skin_mm");
    skin_ratio = column("skin_ratio");
  }
  Reader::Rows pressure(file, "pressure_Pa", {n, loads, height, width});

  data.first = number[0];
  for (hsize_t i = 0; i < n; ++i) {
    if (number[i] != data.first + i) file.refuse("cases that are not in their order");
    if (state[i] < 0 || state[i] > 2) file.refuse("a state of " + std::to_string(state[i]));
    Sample sample;
    sample.what = lump_case(s, number[i]);
    // A case in the file and the same case of its sweep must agree: the file was not edited, the sequence is
    // the same.
    const auto &lump = sample.what.lump, &second = sample.what.second;
    if (shape[i] != (lump ? static_cast<int>(lump->shape) : -1) ||
        !same(diameter[i], lump ? lump->diameter_mm : NAN) || !same(depth[i], lump ? lump->depth_mm : NAN) ||
        !same(ratio[i], lump ? lump->stiffness_ratio : NAN) ||
        !same(second_diameter[i], second ? second->diameter_mm : NAN) ||
        !same(second_ratio[i], second ? second->stiffness_ratio : NAN) ||
        !same(skin[i], sample.what.skin ? sample.what.skin->thickness_mm : NAN) ||
        !same(skin_ratio[i], sample.what.skin ? sample.what.skin->stiffness_ratio : NAN) ||
        !same(thickness[i], sample.what.thickness_mm) || !same(young[i], sample.what.young_Pa))
      file.refuse("case " + std::to_string(number[i]) + " unlike what its sweep makes it");
    sample.state = static_cast<State>(state[i]);
    if (sample.state != State::NotDone) {
      sample.last_press_mm = last_press[i];
      sample.last_force_N = last_force[i];
      sample.steps = steps[i];
      sample.cuts = cuts[i];
      sample.newton_rounds = newton[i];
      sample.iterations = iterations[i];
      const std::vector<float> maps = pressure.read(i);
      const size_t values = width * height;
      for (size_t l = 0; l < loads; ++l) {
        sample.force_N.push_back(force[i * loads + l]);
        sample.residual.push_back(residual[i * loads + l]);
        sample.least_volume_ratio.push_back(volume[i * loads + l]);
        if (std::isnan(sample.force_N[l])) continue;
        PressureMap map;
        map.width = static_cast<uint32_t>(width);
        map.height = static_cast<uint32_t>(height);
        map.pitch_mm = s.pitch_mm();
        map.values.assign(maps.begin() + static_cast<std::ptrdiff_t>(l * values),
                          maps.begin() + static_cast<std::ptrdiff_t>((l + 1) * values));
        sample.pressure_Pa.push_back(std::move(map));
      }
    }
    data.samples.push_back(std::move(sample));
  }
  return data;
}

}  // namespace palpate::lump

// A lump network as a file: a line that names it, a line of JSON (what it was made for and is worth), the
// weights as 32-bit numbers, little endian, and a check sum of all before.
#include <bit>
#include <cmath>
#include <cstring>
#include <fstream>

#include "engine/base/json.h"
#include "engine/lump/network/inverse_network.h"
#include "engine/lump/network/model.h"
#include "engine/lump/network/network.h"
#include "palpate/error.h"

namespace palpate::lump {
namespace {

using Json = json::Value;

constexpr const char* kMagic = "palpate lump network 3\n";
constexpr size_t kLargest = size_t{64} << 20;
static_assert(std::endian::native == std::endian::little);

uint64_t check_sum(const char* bytes, size_t count) {
  uint64_t sum = 0xcbf29ce484222325;  // FNV-1a
  for (size_t i = 0; i < count; ++i) sum = (sum ^ static_cast<uint8_t>(bytes[i])) * 0x100000001b3;
  return sum;
}

/// Matrices one after the other, each preceded by nothing: their sizes are in the JSON.
class Weights {
 public:
  template <typename Matrix>
  void put(const Matrix& matrix) {
    const Eigen::MatrixXf values = matrix.template cast<float>();
    bytes.append(reinterpret_cast<const char*>(values.data()),
                 static_cast<size_t>(values.size()) * sizeof(float));
  }
  void put(const std::vector<SmallNetwork>& networks) {
    for (const SmallNetwork& network : networks)
      for (const SmallNetwork::Layer& layer : network.layers) {
        put(layer.weight);
        put(layer.bias);
      }
  }
  std::string bytes;
};

class Taken {
 public:
  Taken(const char* at, size_t count) : at_(at), left_(count) {}
  template <typename Matrix>
  void take(Matrix& matrix, Eigen::Index rows, Eigen::Index cols) {
    if (rows < 1 || cols < 1 || rows > 4096 || cols > 65536) throw std::runtime_error("a matrix of no size");
    const size_t bytes = static_cast<size_t>(rows * cols) * sizeof(float);
    if (bytes > left_) throw std::runtime_error("fewer weights than it says");
    Eigen::MatrixXf values(rows, cols);
    std::memcpy(values.data(), at_, bytes);
    if (!values.allFinite()) throw std::runtime_error("weights that are no numbers");
    matrix = values.cast<typename Matrix::Scalar>();
    at_ += bytes;
    left_ -= bytes;
  }
  /// Networks of one make: inputs, hidden layers, outputs.
  std::vector<SmallNetwork> take_networks(size_t ensemble, Eigen::Index inputs,
                                          const std::vector<Eigen::Index>& hidden, Eigen::Index outputs) {
    if (ensemble < 1 || ensemble > 64 || hidden.empty() || hidden.size() > 8)
      throw std::runtime_error("networks out of range");
    std::vector<SmallNetwork> networks(ensemble);
    for (SmallNetwork& network : networks) {
      Eigen::Index from = inputs;
      for (size_t l = 0; l <= hidden.size(); ++l) {
        const Eigen::Index to = l < hidden.size() ? hidden[l] : outputs;
        SmallNetwork::Layer layer;
        take(layer.weight, to, from);
        take(layer.bias, to, 1);
        network.layers.push_back(std::move(layer));
        from = to;
      }
    }
    return networks;
  }
  size_t left() const { return left_; }

 private:
  const char* at_;
  size_t left_;
};

/// By Method.
constexpr std::array<const char*, kMethods> kMethodNames = {"network", "refined"};

Json hidden_of(const std::vector<SmallNetwork>& networks) {
  Json widths = Json::array();
  for (size_t l = 0; l + 1 < networks.front().layers.size(); ++l)
    widths.push_back(networks.front().layers[l].weight.rows());
  return widths;
}

Json calibration_json(const Calibration& t) {
  return {{"stretch", t.inflation},
          {"place_stretch", t.place_inflation},
          {"evidence", t.log_likelihood_ratio},
          {"misfit", t.misfit},
          {"rest", t.rest},
          {"no_lump_pattern", t.plain_pattern},
          {"warmth", t.temperature},
          {"median_error", t.median_error},
          {"shape_rate", t.shape_rate}};
}

double positive(const Json& json, const char* key) {
  const double value = json.at(key).get<double>();
  if (!(value > 0 && value < 1e12)) throw std::runtime_error(std::string(key) + " out of range");
  return value;
}

Calibration read_calibration(const Json& json) {
  Calibration t;
  json.at("stretch").get_to(t.inflation);
  for (const double s : t.inflation)
    if (!(s > 0 && s < 1e6)) throw std::runtime_error("stretch out of range");
  t.place_inflation = positive(json, "place_stretch");
  t.log_likelihood_ratio = positive(json, "evidence");
  t.misfit = positive(json, "misfit");
  t.rest = positive(json, "rest");
  t.plain_pattern = positive(json, "no_lump_pattern");
  t.temperature = positive(json, "warmth");
  json.at("median_error").get_to(t.median_error);
  t.shape_rate = json.at("shape_rate").get<double>();
  return t;
}

void read_range(const Json& json, const char* key, std::array<double, 2>& range) {
  json.at(key).get_to(range);
  if (!(range[0] > 0 && range[1] >= range[0] && range[1] < 1e6))
    throw std::runtime_error(std::string(key) + " out of range");
}

void read_inverse(const Json& json, Taken& weights, Eigen::Index fields, InverseNetwork& inverse) {
  json.at("loads").get_to(inverse.loads);
  json.at("mean").get_to(inverse.mean);
  json.at("scale").get_to(inverse.scale);
  for (size_t q = 0; q < inverse.loads.size(); ++q)
    if (!(inverse.loads[q] > (q > 0 ? inverse.loads[q - 1] : 0.0) && inverse.loads[q] < 1e3))
      throw std::runtime_error("the reader's loads do not rise");
  for (size_t p = 0; p < kParameters; ++p)
    if (!(std::abs(inverse.mean[p]) < 100) || !(inverse.scale[p] > 0 && inverse.scale[p] < 100))
      throw std::runtime_error("the reader's scale out of range");
  const auto components = json.at("ways").get<Eigen::Index>();
  const Eigen::Index rows = static_cast<Eigen::Index>(inverse.loads.size()) * fields,
                     inputs = components + InverseNetwork::kOthers + InverseNetwork::kOpen;
  weights.take(inverse.components, rows, components);
  weights.take(inverse.middle, rows, 1);
  weights.take(inverse.in_mean, inputs, 1);
  weights.take(inverse.in_scale, inputs, 1);
  inverse.ensemble =
      weights.take_networks(json.at("members").get<size_t>(), inputs,
                            json.at("hidden").get<std::vector<Eigen::Index>>(), reader_output::kCount);
}

std::shared_ptr<const Model> read_model(const Json& json, Taken& weights) {
  auto model = std::make_shared<Model>();
  Model& m = *model;
  read_range(json, "size_mm", m.size_mm);
  read_range(json, "depth_mm", m.depth_mm);
  read_range(json, "stiffness_ratio", m.ratio);
  read_range(json, "thickness_mm", m.thickness_mm);
  read_range(json, "load", m.load);
  read_range(json, "block_mm", m.block_mm);
  m.node_pitch_mm = positive(json, "node_pitch_mm");
  m.offset_mm = json.at("offset_mm").get<double>();
  m.floor_mm = json.at("floor_mm").get<double>();
  m.cell_mm = positive(json, "cell_mm");
  json.at("shapes").get_to(m.shapes);
  m.load_correlation = json.at("load_correlation").get<double>();
  m.error_over_spread = positive(json, "error_over_spread");
  if (!(m.offset_mm >= 0 && m.offset_mm < 1e3) || !(m.floor_mm >= 0 && m.floor_mm < 1e3) ||
      !(m.load_correlation >= 0 && m.load_correlation < 1))
    throw std::runtime_error("numbers out of range");
  m.false_alarm_rate = positive(json, "false_alarm_rate");
  m.made_from = json.at("made_from").get<std::string>();
  json.at("local_stretch").get_to(m.local);
  for (const auto& of_method : m.local)
    for (const auto& factors : of_method)
      for (const double factor : factors)
        if (!(std::abs(factor) < 10)) throw std::runtime_error("local_stretch out of range");
  for (size_t method = 0; method < kMethods; ++method)
    for (size_t l = 0; l < kCalibrationLoads.size(); ++l)
      for (size_t n = 0; n < kCalibrationNoise.size(); ++n)
        m.calibration[method][l][n] = read_calibration(json.at("trust").at(kMethodNames[method]).at(l).at(n));
  m.base.pitch_mm = m.node_pitch_mm;
  m.base.side = json.at("base_side").get<uint32_t>();
  m.patch.pitch_mm = positive(json, "patch_pitch_mm");
  m.patch.side = json.at("patch_side").get<uint32_t>();
  const auto fields = json.at("fields").get<Eigen::Index>();
  const auto hidden = json.at("hidden").get<std::vector<Eigen::Index>>();
  const auto ensemble = json.at("members").get<size_t>();
  if (m.base.side < 4 || m.base.side > 200 || m.patch.side < 4 || m.patch.side > 200)
    throw std::runtime_error("sizes out of range");
  weights.take(m.base.factors, m.base.side * m.base.side, Base::kTerms);
  weights.take(m.patch.fields, fields, m.patch.side * m.patch.side);
  weights.take(m.in_mean, kFeatures, 1);
  weights.take(m.in_scale, kFeatures, 1);
  weights.take(m.out_mean, fields, 1);
  weights.take(m.out_scale, fields, 1);
  weights.take(m.discrepancy, fields, fields);
  m.ensemble = weights.take_networks(ensemble, kFeatures, hidden, fields);
  read_inverse(json.at("reader"), weights, fields, m.inverse);
  if (weights.left() != 0) throw std::runtime_error("more weights than it says");
  m.patch.prepare();
  return model;
}

}  // namespace

std::string Network::bytes() const {
  const Model& m = *model_;
  Json json{{"size_mm", m.size_mm},
            {"depth_mm", m.depth_mm},
            {"stiffness_ratio", m.ratio},
            {"thickness_mm", m.thickness_mm},
            {"load", m.load},
            {"block_mm", m.block_mm},
            {"node_pitch_mm", m.node_pitch_mm},
            {"offset_mm", m.offset_mm},
            {"floor_mm", m.floor_mm},
            {"cell_mm", m.cell_mm},
            {"shapes", m.shapes},
            {"load_correlation", m.load_correlation},
            {"error_over_spread", m.error_over_spread},
            {"false_alarm_rate", m.false_alarm_rate},
            {"made_from", m.made_from},
            {"base_side", m.base.side},
            {"patch_pitch_mm", m.patch.pitch_mm},
            {"patch_side", m.patch.side},
            {"fields", m.patch.count()},
            {"members", m.ensemble.size()},
            {"local_stretch", m.local}};
  json["hidden"] = hidden_of(m.ensemble);
  for (size_t method = 0; method < kMethods; ++method)
    for (const auto& row : m.calibration[method]) {
      Json list = Json::array();
      for (const Calibration& t : row) list.push_back(calibration_json(t));
      json["trust"][kMethodNames[method]].push_back(std::move(list));
    }
  json["reader"] = {{"loads", m.inverse.loads},
                    {"ways", m.inverse.components.cols()},
                    {"mean", m.inverse.mean},
                    {"scale", m.inverse.scale},
                    {"hidden", hidden_of(m.inverse.ensemble)},
                    {"members", m.inverse.ensemble.size()}};
  json.sort_keys();
  Weights weights;
  weights.put(m.base.factors);
  weights.put(m.patch.fields);
  weights.put(m.in_mean);
  weights.put(m.in_scale);
  weights.put(m.out_mean);
  weights.put(m.out_scale);
  weights.put(m.discrepancy);
  weights.put(m.ensemble);
  weights.put(m.inverse.components);
  weights.put(m.inverse.middle);
  weights.put(m.inverse.in_mean);
  weights.put(m.inverse.in_scale);
  weights.put(m.inverse.ensemble);
  std::string all = kMagic + json.dump() + "\n" + weights.bytes;
  const uint64_t sum = check_sum(all.data(), all.size());
  all.append(reinterpret_cast<const char*>(&sum), sizeof sum);
  return all;
}

Network Network::parse(const std::string& bytes, const std::string& name) {
  const auto refuse = [&name](const std::string& found) {
    throw Error(Failure::Input, "a lump network of version 3", name + ", " + found,
                "palpate-lab train, which makes one");
  };
  const size_t magic = std::strlen(kMagic);
  if (bytes.compare(0, magic, kMagic) != 0)
    refuse(bytes.compare(0, magic - 2, kMagic, magic - 2) == 0 ? "a lump network of another version"
                                                               : "which is none");
  const size_t line = bytes.find('\n', magic);
  if (line == std::string::npos || bytes.size() < line + 1 + sizeof(uint64_t)) refuse("which is cut off");
  const size_t end = bytes.size() - sizeof(uint64_t);
  uint64_t sum = 0;
  std::memcpy(&sum, bytes.data() + end, sizeof sum);
  if (sum != check_sum(bytes.data(), end)) refuse("which is damaged: its checksum differs");
  try {
    Taken weights(bytes.data() + line + 1, end - line - 1);
    return Network(read_model(
        json::parse(std::string_view(bytes).substr(magic, line - magic), {.deepest = 16}), weights));
  } catch (const Error&) {
    throw;
  } catch (const std::exception& error) {
    std::string what = error.what();
    for (char& c : what)
      if (c < ' ' || c > '~') c = '?';  // a damaged file's bytes are no text
    constexpr size_t kLongest = 160;
    refuse("which has other contents: " + (what.size() > kLongest ? what.substr(0, kLongest) + "..." : what));
  }
  return Network(nullptr);
}

Network Network::read(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::string bytes;
  if (in) {
    char buffer[65536];
    while (in.read(buffer, sizeof buffer) || in.gcount() > 0) {
      bytes.append(buffer, static_cast<size_t>(in.gcount()));
      if (bytes.size() > kLargest) break;
    }
  }
  if (!in.is_open() || bytes.empty())
    throw Error(Failure::Input, "a lump network", "no readable file " + file.string(),
                "the path of one, or none for the built-in one");
  return parse(bytes, file.string());
}

}  // namespace palpate::lump

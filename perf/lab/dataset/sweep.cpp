#include "perf/lab/dataset/sweep.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <sstream>

#include "capture/files/tables/csv_table.h"
#include "engine/fem/large_strain/extrapolation.h"
#include "engine/numeric/sobol.h"
#include "palpate/error.h"

namespace palpate::lump {
namespace {

/// Coordinates of the sequence, the best filled first.
enum Coordinate : uint8_t {
  kDiameter,
  kDepth,
  kStiffness,
  kShape,
  kThickness,
  kGreatestPress,
  kOffsetX,
  kOffsetY,
  kYoung,
  kAxis,
  kNoLump,
  kCentred
};

constexpr uint64_t kSecondSeed = 0x632be59bd9b4e019ULL;  // of the second lumps' sequence, over the first's

constexpr uint64_t kSkinSeed = 0x8cb92ba72f3d8dd7ULL;  // the same of the skins'

double even(const Range& range, double u) {
  return range.low + u * (range.high - range.low);
}

double even_in_logarithm(const Range& range, double u) {
  return range.low * std::pow(range.high / range.low, u);
}

std::string text(double value) {
  std::ostringstream out;
  out << value;
  return out.str();
}

void inside(const std::string& what, double value, double low, double high) {
  if (value >= low && value <= high) return;
  throw Error(Failure::Usage, what + " from " + text(low) + " to " + text(high), text(value),
              "a value in that range");
}

void inside(const std::string& what, const Range& range, double low, double high) {
  inside("the least " + what, range.low, low, high);
  inside("the greatest " + what, range.high, low, high);
  if (!(range.low <= range.high))
    throw Error(Failure::Usage, "a range of the " + what + " that rises",
                text(range.low) + " to " + text(range.high), "the lower one first");
}

/// The longest side of the smallest lump of the longest shape.
double longest(const Sweep& s) {
  double length = 1;
  for (const InclusionShape shape : s.shapes) length = std::max(length, length_over_diameter(shape));
  return length;
}

void check_skin(const Sweep& s) {
  inside("thickness of a skin, mm,", s.skin_mm, 0, 100);
  inside("stiffness ratio of a skin", s.skin_ratio, 0.01, 1e5);
  if (!s.has_skin()) return;
  if (s.skin_mm.low == 0)
    throw Error(Failure::Usage, "a skin above 0 mm on every block, or none", "some of 0 mm",
                "--skin-mm 1 3, and another data set without");
  if (s.skin_mm.high > s.thickness_mm.low / 2)
    throw Error(Failure::Usage, "a skin of half the block's thickness at most",
                text(s.skin_mm.high) + " mm of " + text(s.thickness_mm.low), "a thinner skin");
  if (s.depth_mm.low < s.skin_mm.high)
    throw Error(Failure::Usage, "lumps below the skin, " + text(s.skin_mm.high) + " mm deep or deeper",
                text(s.depth_mm.low) + " mm", "a larger least --depth-mm");
}

}  // namespace

bool Sweep::follows_lumps() const {
  return two_grids() && fem::common_cells(cells, coarser_cells).has_value();
}

void check(const Sweep& s) {
  inside("diameter, mm,", s.size_mm, 0.5, 100);
  inside("depth, mm,", s.depth_mm, 0, 100);
  inside("stiffness ratio", s.stiffness_ratio, 0.01, 1e5);
  inside("thickness, mm,", s.thickness_mm, 1, 1000);
  inside("modulus of the tissue, Pa,", s.young_Pa, 1, 1e9);
  inside("press as a share of the thickness", s.greatest_press, 1e-4, 0.45);
  inside("the offset to either side, mm,", s.offset_mm, 0, 500);
  for (const double side : s.block_mm) inside("the block's length and width, mm,", side, 1, 1000);
  inside("Poisson's ratio", s.poisson, 0, 0.4999);
  inside("the tissue below a lump, mm,", s.floor_mm, 0, 100);
  inside("the tissue beside a lump, mm,", s.rim_mm, 0, 100);
  inside("growth of the diameter", s.grown, -0.5, 1);
  inside("the stiffness ratio's change", s.stiffened, -0.9, 10);
  inside("the share without a lump", s.no_lump_fraction, 0, 1);
  inside("the tissue between two lumps, mm,", s.second_gap_mm, 0, 100);
  if (s.second_gap_mm > 0 && (s.grown != 0 || s.stiffened != 0))
    throw Error(Failure::Usage, "one day of blocks with two lumps", "another day of them",
                "--second-lump without --grown and --stiffened");
  if (s.second_gap_mm > 0 && longest(s) * s.size_mm.high + s.second_gap_mm > 2 * s.offset_mm)
    throw Error(Failure::Usage, "offsets that leave room for two of the largest lumps",
                text(s.offset_mm) + " mm to either side", "a larger --offset-mm or smaller lumps");
  check_skin(s);
  inside("the plate's coefficient of friction", s.plate_friction, 0, 2);
  if (s.plate_sticks && s.plate_friction > 0)
    throw Error(Failure::Usage, "either a plate that sticks or one that slides with friction", "both",
                "one of the two");
  inside("the share in the middle", s.centred_fraction, 0, 1);
  inside("loads", s.loads, 1, 32);
  for (const uint32_t nodes : s.nodes) inside("nodes of a map along a side", nodes, 2, 1024);
  for (const uint32_t cells : s.cells) inside("cells along a side", cells, 4, 512);
  if (s.two_grids()) {
    for (size_t c = 0; c < 3; ++c)
      if (s.coarser_cells[c] * s.cells[0] != s.coarser_cells[0] * s.cells[c])
        throw Error(
            Failure::Usage, "coarser cells in the proportions of the cells",
            text(s.coarser_cells[0]) + "x" + text(s.coarser_cells[1]) + "x" + text(s.coarser_cells[2]),
            "--cells 48x48x24 --coarser-cells 24x24x12, or 0 for one grid");
    for (size_t c = 0; c < 3; ++c)
      inside("coarser cells along a side", s.coarser_cells[c], 4, std::max(4u, s.cells[c] - 1));
    if (s.coarser_cells[0] >= s.cells[0])
      throw Error(Failure::Usage, "coarser cells fewer than the cells", "as many",
                  "--coarser-cells 0 for one grid");
  }
  inside("the residual", s.residual, 1e-10, 1e-2);
  inside("the step of the press, mm,", s.step_mm, 0.01, 10);
  if (s.shapes.empty()) throw Error(Failure::Usage, "a shape or more", "none", "--shapes sphere");
  if (s.grown > 0 && s.size_mm.high * s.grown / 2 > std::min(s.depth_mm.low - s.skin_mm.high, s.floor_mm))
    throw Error(Failure::Usage, "a least depth and tissue below a lump that its growth leaves room for",
                text(s.size_mm.high * s.grown / 2) + " mm of growth to either side",
                "a larger --depth-mm and --floor-mm");
  const double high = s.floor_mm + s.depth_mm.low + s.size_mm.low;
  if (high > s.thickness_mm.low)
    throw Error(Failure::Usage, "blocks that hold the smallest lump, " + text(high) + " mm thick",
                text(s.thickness_mm.low) + " mm", "thicker blocks, or a smaller diameter or depth");
  const double wide = 2 * s.rim_mm + longest(s) * s.size_mm.low;
  const double side = std::min(s.block_mm[0], s.block_mm[1]);
  if (wide > side)
    throw Error(Failure::Usage, "blocks that hold the smallest lump, " + text(wide) + " mm wide",
                text(side) + " mm", "wider blocks, a smaller diameter, or fewer --shapes");
}

namespace {

/// A lump in a block, of a point of the sequence; in the middle. Its long axis is y where `along_y` says so.
Case::Lump drawn_lump(const Sweep& s, double thickness_mm, const std::array<double, kSobolDimensions>& u,
                      bool along_y) {
  Case::Lump lump;
  lump.shape = s.shapes[std::min(s.shapes.size() - 1,
                                 static_cast<size_t>(u[kShape] * static_cast<double>(s.shapes.size())))];
  const double length = length_over_diameter(lump.shape);
  lump.along_y = length > 1 && along_y;
  const double narrow_mm = std::min(s.block_mm[0], s.block_mm[1]) - 2 * s.rim_mm;
  const double thickest_mm = thickness_mm - s.floor_mm;
  const double largest_mm = std::min({s.size_mm.high, thickest_mm - s.depth_mm.low, narrow_mm / length});
  const auto spread = s.logarithmic && s.depth_mm.low > 0 ? even_in_logarithm : even;
  lump.diameter_mm = spread({s.size_mm.low, largest_mm}, u[kDiameter]);
  const double deepest_mm = std::min(s.depth_mm.high, thickest_mm - lump.diameter_mm);
  lump.depth_mm = spread({s.depth_mm.low, deepest_mm}, u[kDepth]);
  lump.stiffness_ratio = even_in_logarithm(s.stiffness_ratio, u[kStiffness]);
  return lump;
}

/// The second lump and both places: any direction, any distance that it allows, any middle between them.
void add_second(const Sweep& s, const std::array<double, kSobolDimensions>& first, Case& what) {
  const std::array<double, kSobolDimensions> u = sobol(s.seed ^ kSecondSeed, what.number);
  Case::Lump &one = *what.lump, two = drawn_lump(s, what.thickness_mm, u, one.along_y);
  const double angle = std::numbers::pi * u[kCentred];
  const std::array<double, 2> along = {std::cos(angle), std::sin(angle)};
  const double most_mm = 2 * s.offset_mm / std::max(std::abs(along[0]), std::abs(along[1]));
  const double wide_mm =
      one.diameter_mm * length_over_diameter(one.shape) + two.diameter_mm * length_over_diameter(two.shape);
  const double apart_mm = even({s.second_gap_mm + wide_mm / 2, most_mm}, u[kOffsetX]);
  for (size_t c = 0; c < 2; ++c) {
    const double half_mm = apart_mm / 2 * along[c], left_mm = s.offset_mm - std::abs(half_mm);
    const double middle_mm = even({-left_mm, left_mm}, first[c == 0 ? kOffsetX : kOffsetY]);
    one.offset_mm[c] = middle_mm - half_mm;
    two.offset_mm[c] = middle_mm + half_mm;
  }
  what.second = two;
}

}  // namespace

Case lump_case(const Sweep& s, uint32_t number) {
  const std::array<double, kSobolDimensions> u = sobol(s.seed, number);
  Case what;
  what.number = number;
  what.thickness_mm = even(s.thickness_mm, u[kThickness]);
  what.young_Pa = even_in_logarithm(s.young_Pa, u[kYoung]);
  const double greatest_mm = even(s.greatest_press, u[kGreatestPress]) * what.thickness_mm;
  for (uint32_t load = 1; load <= s.loads; ++load) what.press_mm.push_back(greatest_mm * load / s.loads);
  if (s.has_skin()) {
    const std::array<double, kSobolDimensions> v = sobol(s.seed ^ kSkinSeed, number);
    what.skin = fem::Skin{even(s.skin_mm, v[kThickness]), even_in_logarithm(s.skin_ratio, v[kStiffness])};
  }
  what.plate_sticks = s.plate_sticks;
  what.plate_friction = s.plate_friction;
  if (u[kNoLump] < s.no_lump_fraction) return what;

  Case::Lump lump = drawn_lump(s, what.thickness_mm, u, u[kAxis] < 0.5);
  if (s.second_gap_mm > 0) {
    what.lump = lump;
    add_second(s, u, what);
    return what;
  }
  const std::array<double, 3> size_mm = lump.size_mm();
  const bool centred = u[kCentred] < s.centred_fraction;
  for (size_t c = 0; c < 2 && !centred; ++c) {
    const double most = std::max(0.0, std::min(s.offset_mm, s.block_mm[c] / 2 - s.rim_mm - size_mm[c] / 2));
    lump.offset_mm[c] = even({-most, most}, u[kOffsetX + c]);
  }
  const double more_mm = lump.diameter_mm * s.grown;
  lump.diameter_mm += more_mm;
  lump.depth_mm -= more_mm / 2;
  lump.stiffness_ratio *= 1 + s.stiffened;
  what.lump = lump;
  return what;
}

fem::Scene scene_of(const Sweep& s, const Case& what) {
  return scene_of(what, s.block_mm, s.poisson, s.cells);
}

json::Value to_json(const Sweep& s) {
  const auto pair = [](const Range& r) { return json::Value::array({r.low, r.high}); };
  json::Value shapes = json::Value::array();
  for (const InclusionShape shape : s.shapes) shapes.push_back(to_string(shape));
  json::Value all = {{"sequence", "sobol, scrambled"},
                     {"seed", s.seed},
                     {"diameter_mm", pair(s.size_mm)},
                     {"depth_mm", pair(s.depth_mm)},
                     {"logarithmic", s.logarithmic},
                     {"stiffness_ratio", pair(s.stiffness_ratio)},
                     {"thickness_mm", pair(s.thickness_mm)},
                     {"young_Pa", pair(s.young_Pa)},
                     {"greatest_press_over_thickness", pair(s.greatest_press)},
                     {"offset_mm", s.offset_mm},
                     {"centred_share", s.centred_fraction},
                     {"block_mm", s.block_mm},
                     {"poisson", s.poisson},
                     {"floor_mm", s.floor_mm},
                     {"rim_mm", s.rim_mm},
                     {"shapes", shapes},
                     {"no_lump_share", s.no_lump_fraction},
                     {"loads", s.loads},
                     {"cells", s.cells},
                     {"coarser_cells", s.coarser_cells},
                     {"cells_follow_lumps", s.follows_lumps()},
                     {"nodes", s.nodes},
                     {"residual", s.residual},
                     {"step_mm", s.step_mm}};
  // Files of a first day have neither, those of single lumps no gap, those of tissue alone no skin, those
  // under a plate that slides nothing of it.
  if (s.has_skin()) {
    all["skin_mm"] = pair(s.skin_mm);
    all["skin_ratio"] = pair(s.skin_ratio);
  }
  if (s.plate_sticks) all["plate_sticks"] = true;
  if (s.plate_friction != 0) all["plate_friction"] = s.plate_friction;
  if (s.grown != 0) all["grown"] = s.grown;
  if (s.stiffened != 0) all["stiffened"] = s.stiffened;
  if (s.second_gap_mm != 0) all["second_gap_mm"] = s.second_gap_mm;
  return all;
}

Sweep sweep_from_json(const std::string& text) {
  Sweep s;
  try {
    const json::Value v = json::parse(text);
    const auto range = [&](const char* key) {
      return Range{v.at(key).at(0).get<double>(), v.at(key).at(1).get<double>()};
    };
    s.seed = v.at("seed").get<uint64_t>();
    s.size_mm = range("diameter_mm");
    s.depth_mm = range("depth_mm");
    s.logarithmic = v.contains("logarithmic") && v.at("logarithmic").get<bool>();  // older files: even
    s.stiffness_ratio = range("stiffness_ratio");
    s.thickness_mm = range("thickness_mm");
    s.young_Pa = range("young_Pa");
    s.greatest_press = range("greatest_press_over_thickness");
    s.offset_mm = v.at("offset_mm").get<double>();
    s.centred_fraction = v.at("centred_share").get<double>();
    s.block_mm = v.at("block_mm").get<std::array<double, 2>>();
    s.poisson = v.at("poisson").get<double>();
    s.floor_mm = v.at("floor_mm").get<double>();
    s.rim_mm = v.at("rim_mm").get<double>();
    s.shapes.clear();
    for (const json::Value& name : v.at("shapes")) {
      const auto* const found =
          std::find(std::begin(kShapeNames), std::end(kShapeNames), name.get<std::string>());
      if (found == std::end(kShapeNames))
        throw Error(Failure::Input, "a shape", printable(name.text()), "another file");
      s.shapes.push_back(static_cast<InclusionShape>(found - std::begin(kShapeNames)));
    }
    if (v.contains("skin_mm")) {
      s.skin_mm = range("skin_mm");
      s.skin_ratio = range("skin_ratio");
    }
    if (v.contains("plate_sticks")) s.plate_sticks = v.at("plate_sticks").get<bool>();
    if (v.contains("plate_friction")) s.plate_friction = v.at("plate_friction").get<double>();
    if (v.contains("grown")) s.grown = v.at("grown").get<double>();
    if (v.contains("stiffened")) s.stiffened = v.at("stiffened").get<double>();
    if (v.contains("second_gap_mm")) s.second_gap_mm = v.at("second_gap_mm").get<double>();
    s.no_lump_fraction = v.at("no_lump_share").get<double>();
    s.loads = v.at("loads").get<uint32_t>();
    s.cells = v.at("cells").get<std::array<uint32_t, 3>>();
    s.coarser_cells = v.at("coarser_cells").get<std::array<uint32_t, 3>>();
    s.nodes = v.at("nodes").get<std::array<uint32_t, 2>>();
    s.residual = v.at("residual").get<double>();
    s.step_mm = v.at("step_mm").get<double>();
    check(s);
  } catch (const json::Error& error) {
    throw Error(Failure::Input, "a sweep of lumps as JSON", error.what(),
                "a file that `palpate-lab dataset` wrote");
  } catch (const Error& error) {
    throw Error(Failure::Input, "a sweep of lumps as JSON", std::string("one that fails: ") + error.what(),
                "a file that `palpate-lab dataset` wrote");
  }
  return s;
}

}  // namespace palpate::lump
